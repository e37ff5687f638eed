//! Many frames in lockstep with a caster that moves, frames that change and lights that come and go: memory stays flat.

use crate::desk::{Desk, SIZE, desk_picture};
use bevy::prelude::*;
use bevy_mirrorball::{camera::FramePixels, headless, prelude::*};

/// Frames per second of simulated time.
const RATE: u32 = 30;
/// Simulated seconds of the short run, and after which the memory is compared.
const SECONDS: u32 = 16;
/// Memory that a run may add after its first quarter.
const MAX_GROWTH: f64 = 0.02;

/// Memory of this process in bytes, as Linux tells.
fn memory() -> Option<f64> {
    let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
    let resident: f64 = pages.split_whitespace().nth(1)?.parse().ok()?;
    Some(4096.0 * resident)
}

/// A dome that software Vulkan draws in a few milliseconds.
fn small_dome() -> ShadowDomeLight {
    ShadowDomeLight { directions: 8, resolution: 64, refreshed_per_frame: 4, ..default() }
}

/// Lets the desk run, and returns the memory after the first quarter and the growth since, as a fraction.
fn run(seconds: u32) -> Option<(f64, f64)> {
    let mut desk = Desk::new()?;
    let thing = desk.add_virtual(Cuboid::from_length(0.06), Vec3::new(0.0, 0.03, 0.0));
    desk.app.world_mut().entity_mut(desk.dome).insert(small_dome());
    headless::settle(&mut desk.app).expect("all shaders compile");
    let frames = [0u8, 20].map(|shift| {
        let rgba = desk_picture().into_iter().map(|byte| byte.saturating_sub(shift)).collect();
        std::sync::Arc::new(FramePixels::new(SIZE, rgba).expect("as many bytes as the size says"))
    });
    let (count, mut first) = (seconds * RATE, 0.0);
    for frame in 0..count {
        let angle = frame as f32 / RATE as f32;
        let place = Vec3::new(0.1 * angle.cos(), 0.03, 0.1 * angle.sin());
        let feed = CameraFeed::pixels(frames[frame as usize % 2].clone()).with_pace(FeedPace::Lockstep);
        let world = desk.app.world_mut();
        world.entity_mut(thing).insert(Transform::from_translation(place));
        world.entity_mut(desk.camera).insert(feed);
        // Every second something is taken away and made anew.
        if frame % RATE == 0 {
            let material = StandardMaterial { base_color: Color::hsl(frame as f32, 0.5, 0.5), ..default() };
            let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
            let style = if frame % (2 * RATE) == 0 {
                SurfaceStyle::ImageBased
            } else {
                SurfaceStyle::Toon(ToonStyle::default())
            };
            world.entity_mut(thing).insert((MeshMaterial3d(material), style));
            world.despawn(desk.dome);
            desk.dome = world.spawn(small_dome()).id();
        }
        headless::update(&mut desk.app).expect("rendering goes on");
        if frame % RATE == 0 {
            // Frames that the GPU has not drawn yet are no leak.
            headless::read_texture(&mut desk.app, &desk.picture).expect("the picture comes back");
        }
        if frame == count / 4 {
            first = memory()?;
        }
    }
    headless::read_texture(&mut desk.app, &desk.picture).expect("the picture comes back");
    Some((first, memory()? / first - 1.0))
}

#[test]
#[ignore = "the memory of a process is that of all tests in it: run it alone, MIRRORBALL_RUN_SECONDS=3600 for an hour"]
fn memory_stays_flat() {
    let seconds = std::env::var("MIRRORBALL_RUN_SECONDS").ok().and_then(|seconds| seconds.parse().ok());
    let seconds = seconds.unwrap_or(SECONDS);
    let Some((first, growth)) = run(seconds) else { return };
    println!("{seconds} s: {:.1} MiB after a quarter, {:+.2} % since", first / 1048576.0, 1e2 * growth);
    assert!(growth <= MAX_GROWTH, "memory grew by {:.2} %", 1e2 * growth);
}

#[test]
fn many_frames_are_drawn_while_things_come_and_go() {
    // Memory is looked at by the test that runs alone.
    run(4);
}
