//! Dome shadows on the frame of a desk seen from above, under a uniform sky.

use crate::desk;
use crate::desk::{Desk, Shot, desk_picture};
use bevy::{
    camera::Hdr,
    core_pipeline::prepass::{DepthPrepass, NormalPrepass},
    prelude::*,
};
use bevy_mirrorball::{
    MirrorballSystems,
    lighting::RealLight,
    materials::ImageBasedMaterial,
    prelude::*,
    shadows::{DomeState, VisibilitySamples},
};

/// Rounding to 8 bits.
const SAME: u8 = 1;
/// 64 directions stand for 2.8° each around; the steps of a dome's penumbra are about this large.
const RATIO_TOLERANCE: f32 = 0.04;
/// Largest difference of things that have no sample of their own.
const THIN: u8 = 6;
/// The least difference that counts as a shadow, in sRGB steps: well above rounding.
const DARKER: u8 = 6;

#[test]
fn real_things_alone_leave_the_picture_as_it_is() {
    let Some(mut desk) = Desk::new() else { return };
    let empty = desk.shoot().difference(&desk_picture());
    desk.add(Cuboid::new(0.1, 0.1, 0.1), Vec3::new(-0.1, 0.05, 0.0), PhantomObject::default());
    let with_box = desk.shoot().difference(&desk_picture());
    println!("nothing virtual: off by {empty}/255, with a real box by {with_box}/255");
    assert!(empty <= SAME && with_box <= SAME);
}

#[test]
fn a_virtual_box_shadows_the_desk_around_it_until_the_dome_or_the_receiver_goes() {
    let Some(mut desk) = Desk::new() else { return };
    let cube = desk.add_virtual(Cuboid::new(0.06, 0.06, 0.06), Vec3::new(-0.15, 0.03, 0.0));
    let (near, far) = (Vec3::new(-0.105, 0.0, 0.0), Vec3::new(0.3, 0.0, 0.2));
    let shadowed = desk.shoot();
    println!("1.5 cm beside the box {} steps darker, 50 cm away {}", shadowed.darkened(near), shadowed.darkened(far));
    assert!(shadowed.darkened(near) >= DARKER.into());
    assert!(shadowed.darkened(far).abs() <= SAME.into());

    desk.app.world_mut().entity_mut(desk.plane).insert(PhantomObject { casts: false, receives: false, ..default() });
    let not_receiving = desk.shoot();
    println!("not receiving: {} steps", not_receiving.darkened(near));
    assert!(not_receiving.darkened(near).abs() <= SAME.into());
    desk.app.world_mut().entity_mut(desk.plane).insert(PhantomObject { casts: false, ..default() });
    let again = desk.shoot().difference(&shadowed.0);
    assert!(again <= SAME, "receiving again: off by {again}");

    let dome = desk.app.world().get::<ShadowDomeLight>(desk.dome).expect("it is a dome").clone();
    desk.app.world_mut().entity_mut(desk.dome).remove::<ShadowDomeLight>();
    let without_dome = desk.shoot();
    println!("without dome: {} steps", without_dome.darkened(near));
    assert!(without_dome.darkened(near).abs() <= SAME.into());
    desk.app.world_mut().entity_mut(desk.dome).insert(dome);
    let again = desk.shoot().difference(&shadowed.0);
    assert!(again <= SAME, "a dome again: off by {again}");

    desk.app.world_mut().despawn(cube);
    let empty = desk.shoot().difference(&desk_picture());
    println!("box gone: off by {empty}/255");
    assert!(empty <= SAME);
}

#[test]
fn a_wall_takes_the_light_of_the_sky_behind_it() {
    const WALL_HEIGHT: f32 = 0.5;
    const FOOT: f32 = -0.25;
    let Some(mut desk) = Desk::new() else { return };
    desk.add_virtual(Cuboid::new(0.02, WALL_HEIGHT, 3.0), Vec3::new(FOOT - 0.01, 0.5 * WALL_HEIGHT, 0.0));
    let shot = desk.shoot();
    for away in [0.015, 0.05, 0.1, 0.2, 0.4] {
        // A long wall hides half of (1 − sin of the angle between its upper edge and the zenith) of a uniform sky.
        let expected = 0.5 * (1.0 + (away / WALL_HEIGHT).atan().sin());
        let ratio = shot.ratio(Vec3::new(FOOT + away, 0.0, 0.03));
        println!("{away} m from the wall: {ratio:.3} of the light, expected {expected:.3}");
        assert!((ratio - expected).abs() <= RATIO_TOLERANCE);
    }
}

#[test]
fn a_real_box_hides_what_is_behind_it() {
    let Some(mut desk) = Desk::new() else { return };
    let hidden = desk.add_virtual(Cuboid::new(0.05, 0.02, 0.05), Vec3::new(-0.1, 0.01, 0.0));
    assert!(desk.shoot().difference(&desk_picture()) > DARKER, "in view at first");
    let phantom = PhantomObject::default();
    desk.add(Cuboid::new(0.14, 0.04, 0.14), Vec3::new(-0.1, 0.1, 0.0), phantom);
    let shot = desk.shoot();
    let top = (-6..=6).flat_map(|x| (-6..=6).map(move |z| Vec3::new(-0.1 + 0.01 * x as f32, 0.12, 0.01 * z as f32)));
    let worst = top.map(|place| shot.darkened(place).abs()).max().unwrap_or(0);
    println!("above what is hidden: off by {worst}/255");
    assert!(worst <= SAME.into());
    desk.app.world_mut().despawn(hidden);
}

#[test]
fn a_surface_under_the_open_sky_looks_as_without_dome() {
    let Some(mut desk) = Desk::new() else { return };
    let ball = Sphere::new(0.06).mesh().ico(12).expect("few enough");
    // The whole slab, and the ball down to where its sides turn away from the camera.
    for (mesh, place, top, reach) in
        [(ball, -0.12, 0.06, 0.04), (Cuboid::new(0.1, 0.02, 0.1).into(), 0.02, 0.01, 0.045)]
    {
        let center = Vec3::new(place, 0.1, -0.05);
        let thing = desk.add_virtual(mesh, center);
        let under_dome = desk.shoot();
        let is_shadowed = desk.app.world().entity(thing).contains::<MeshMaterial3d<ImageBasedMaterial>>();
        assert!(is_shadowed, "the dome has taken over");
        desk.app.world_mut().entity_mut(thing).insert(SurfaceStyle::Engine);
        let engine = desk.shoot();
        let at = engine.at(center + top * Vec3::Y);
        assert!(engine.0[at] > engine.0[at + 2].saturating_add(DARKER), "an orange thing is in view");
        let places = (-9..=9).flat_map(|x| (-9..=9).map(move |z| Vec3::new(x as f32, 0.0, z as f32) / 9.0));
        let places = places.filter(|p| reach > 0.04 || p.length() < 1.0).map(|p| center + top * Vec3::Y + reach * p);
        let worst = places.map(|p| under_dome.0[under_dome.at(p)].abs_diff(engine.0[engine.at(p)])).max().unwrap_or(0);
        let everywhere = under_dome.difference(&engine.0);
        println!("dome against engine: off by {worst}/255, anywhere in the picture {everywhere}/255");
        assert!(worst <= SAME);
        desk.app.world_mut().despawn(thing);
    }
}

/// How the visibility pass may differ from what every fragment finds by itself: along edges of shadows.
const INTERPOLATED: u8 = 12;

/// Share of bytes that differ by more than rounding.
fn share_of_different(a: &Shot, b: &Shot) -> f32 {
    let different = a.0.iter().zip(&b.0).filter(|(a, b)| a.abs_diff(**b) > SAME).count();
    different as f32 / a.0.len() as f32
}

fn furnished(kind: impl Bundle, samples: VisibilitySamples) -> Option<Shot> {
    let mut desk = Desk::new()?;
    desk.add_virtual(Cuboid::new(0.06, 0.06, 0.06), Vec3::new(-0.15, 0.03, 0.0));
    desk.add_virtual(Sphere::new(0.04).mesh().ico(12).expect("few enough"), Vec3::new(0.05, 0.04, 0.05));
    desk.add(Cuboid::new(0.05, 0.1, 0.05), Vec3::new(-0.05, 0.05, -0.1), PhantomObject::default());
    let world = desk.app.world_mut();
    world.entity_mut(desk.dome).insert(ShadowDomeLight { samples, ..default() });
    world.entity_mut(desk.camera).insert(kind);
    Some(desk.shoot())
}

#[test]
fn the_visibility_pass_finds_what_every_fragment_would() {
    let Some(fragment) = furnished(Msaa::Off, VisibilitySamples::Fragment) else { return };
    let unshadowed = share_of_different(&fragment, &Shot(desk::desk_picture()));
    for (samples, most, most_different) in [
        (VisibilitySamples::Full, INTERPOLATED, 0.02),
        (VisibilitySamples::Half, INTERPOLATED, 0.1),
        (VisibilitySamples::Interleaved, 2 * INTERPOLATED, 0.1),
    ] {
        let shot = furnished(Msaa::Off, samples).expect("a GPU");
        let (worst, share) = (shot.difference(&fragment.0), share_of_different(&shot, &fragment));
        println!("{samples:?}: off by up to {worst}/255, {:.1} % of the picture by more than rounding", 100.0 * share);
        assert!(worst <= most && share <= most_different);
    }
    // Less than of direct light alone: what is near lights the shadows.
    assert!(unshadowed > 0.1, "there is something to see");
}

#[test]
fn things_thinner_than_a_sample_are_as_bright_as_with_a_sum_of_their_own() {
    // Four tenths of a pixel wide, beside a wall.
    let stick = Cuboid::new(0.003, 0.003, 0.3);
    let shoot = |samples, has_wall: bool| {
        let mut desk = Desk::new()?;
        desk.app.world_mut().entity_mut(desk.dome).insert(ShadowDomeLight { samples, ..default() });
        desk.add_virtual(stick, Vec3::new(0.04, 0.0015, 0.0));
        if has_wall {
            desk.add_virtual(Cuboid::new(0.02, 0.2, 0.4), Vec3::new(-0.02, 0.1, 0.0));
        }
        Some(desk.shoot())
    };
    let [Some(sampled), Some(summed), Some(open)] = [
        (VisibilitySamples::Interleaved, true),
        (VisibilitySamples::Fragment, true),
        (VisibilitySamples::Fragment, false),
    ]
    .map(|(samples, has_wall)| shoot(samples, has_wall)) else {
        return;
    };
    let along = (-12..=12).map(|i| summed.at(Vec3::new(0.04, 0.003, 0.01 * i as f32)));
    let off = |shot: &Shot| along.clone().map(|at| shot.0[at].abs_diff(summed.0[at])).max().unwrap_or(0);
    let (thin, shadow) = (off(&sampled), off(&open));
    println!("a thin stick: off by {thin}/255, of {shadow}/255 that the shadow of the wall takes");
    assert!(shadow >= DARKER && thin <= THIN);
}

#[test]
fn cameras_of_other_kinds_see_the_same_shadows() {
    let samples = VisibilitySamples::default();
    let Some(plain) = furnished(Msaa::Off, samples) else { return };
    let multisampled = furnished(Msaa::Sample4, samples).expect("a GPU");
    let wide = furnished(Hdr, samples).expect("a GPU");
    let kept_prepass = furnished((DepthPrepass, NormalPrepass), VisibilitySamples::Fragment).expect("a GPU");
    let fragment = furnished(Msaa::Off, VisibilitySamples::Fragment).expect("a GPU");
    for (name, shot, like, share) in [
        // Edges of things are smoothed.
        ("4 samples a pixel", &multisampled, &plain, 0.1),
        ("HDR", &wide, &plain, 0.01),
        ("a prepass of its own", &kept_prepass, &fragment, 0.01),
    ] {
        let different = share_of_different(shot, like);
        println!("{name}: {:.2} % of the picture differs", 100.0 * different);
        assert!(different <= share);
    }
}

#[test]
fn a_camera_keeps_its_prepass_when_the_dome_goes_and_loses_the_domes() {
    for keeps in [false, true] {
        let Some(mut desk) = Desk::new() else { return };
        let camera = desk.camera;
        if keeps {
            desk.app.world_mut().entity_mut(camera).insert(DepthPrepass);
        }
        desk.app.update();
        desk.app.update();
        assert!(desk.app.world().entity(camera).contains::<NormalPrepass>());
        desk.app.world_mut().entity_mut(desk.dome).remove::<ShadowDomeLight>();
        desk.app.update();
        desk.app.update();
        let camera = desk.app.world().entity(camera);
        assert!(!camera.contains::<NormalPrepass>());
        assert_eq!(camera.contains::<DepthPrepass>(), keeps);
    }
}

#[test]
fn a_light_has_its_shadow_map_in_the_frame_in_which_it_is_found() {
    let Some(mut desk) = Desk::new() else { return };
    desk.add_virtual(Cuboid::new(0.06, 0.06, 0.06), Vec3::new(-0.15, 0.03, 0.0));
    desk.shoot();
    let find = |mut commands: Commands, mut is_found: Local<bool>| {
        if !std::mem::replace(&mut *is_found, true) {
            commands.spawn(RealLight {
                id: 0,
                direction: Vec3::new(0.3, 0.9, 0.2).normalize(),
                position: None,
                color: LinearRgba::WHITE,
                irradiance: 1.0,
                angular_radius: 0.01,
                fraction: 0.5,
            });
        }
    };
    desk.app.add_systems(PostUpdate, find.in_set(MirrorballSystems::Light));
    desk.app.update();
    let state = desk.app.world().get::<DomeState>(desk.dome).expect("comes with the dome");
    assert_eq!(state.key_lights, 1);
}
