//! What a camera draws into: a part of its target, fewer pixels, a second target.

use super::{IN_SHADOW, ON_TOP, Picture, SEEN, Scene, UNCHANGED};
use crate::desk::{HEIGHT, SIZE};
use bevy::{
    camera::{MainPassResolutionOverride, Viewport},
    core_pipeline::tonemapping::Tonemapping,
    prelude::*,
    render::{RenderApp, sync_world::RenderEntity},
};
use bevy_mirrorball::camera::srgb_to_linear;

/// Half of the size of the pictures.
const HALF: UVec2 = UVec2::new(48, 32);
/// Filtering of 2 × 2 pixels in 8 bits, and where edges fall.
const REDUCED: f32 = 4.0;

impl Picture {
    /// Mean of 2 × 2 pixels from a pixel on, in linear light, as 8-bit sRGB.
    fn reduced(&self, x: u32, y: u32) -> [f32; 3] {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| self.pixel(((y + dy) * SIZE.x + x + dx) as usize));
        [0, 1, 2].map(|c| {
            let mean = four.iter().map(|rgb| srgb_to_linear(rgb[c])).sum::<f32>() / 4.0;
            255.0 * Color::linear_rgb(mean, mean, mean).to_srgba().red
        })
    }

    /// Fraction of the pixels of a part of this picture that differ from the whole of another one at half the size, and
    /// the largest difference where the other shows the photograph.
    fn compare_part(&self, corner: UVec2, plain: &Self, photo: &Self) -> (f32, f32) {
        let (mut different, mut behind) = (0, 0.0f32);
        for (x, y) in (0..HALF.y).flat_map(|y| (0..HALF.x).map(move |x| (x, y))) {
            let here = self.pixel(((y + corner.y) * SIZE.x + x + corner.x) as usize);
            let off = |of: &Self| {
                let wanted = of.reduced(2 * x, 2 * y);
                (0..3).map(|c| (f32::from(here[c]) - wanted[c]).abs()).fold(0.0, f32::max)
            };
            different += u32::from(off(plain) > REDUCED);
            let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| ((2 * y + dy) * SIZE.x + 2 * x + dx) as usize);
            if four.into_iter().all(|i| plain.pixel_difference(photo, i) <= 1) {
                behind = behind.max(off(photo));
            }
        }
        (different as f32 / HALF.element_product() as f32, behind)
    }
}

/// Fraction of pixels whose differences edges of the box explain.
const EDGES: f32 = 0.04;

#[test]
fn a_viewport_shows_the_whole_picture_in_its_part() {
    let Some(mut scene) = Scene::with_box() else { return };
    let plain = scene.shoot();
    let corner = UVec2::new(30, 20);
    let viewport = Viewport { physical_position: corner, physical_size: HALF, ..default() };
    scene.on_camera(Camera { viewport: Some(viewport), ..default() });
    let shown = scene.shoot();
    shown.save("viewport");
    let (different, behind) = shown.compare_part(corner, &plain, &scene.photo);
    println!("viewport: {different} of the pixels differ, {behind}/255 behind");
    assert!(behind <= REDUCED && different <= EDGES, "{behind}/255, {different}");
}

#[test]
fn a_main_pass_of_fewer_pixels_shows_the_same() {
    let Some(mut scene) = Scene::with_box() else { return };
    let plain = scene.shoot();
    let world = scene.desk.app.world();
    let camera = world.get::<RenderEntity>(scene.desk.camera).expect("cameras are drawn").id();
    let render_world = scene.desk.app.sub_app_mut(RenderApp).world_mut();
    render_world.entity_mut(camera).insert(MainPassResolutionOverride(HALF));
    let shown = scene.shoot();
    shown.save("render_scale");
    // What scales it up is up to the game; it finds the picture in the corner.
    let (different, behind) = shown.compare_part(UVec2::ZERO, &plain, &scene.photo);
    println!("render scale: {different} of the pixels differ, {behind}/255 behind");
    assert!(behind <= REDUCED && different <= EDGES, "{behind}/255, {different}");
}

#[test]
fn a_second_target_shows_virtual_things_and_changes_nothing_in_the_first() {
    let Some(mut scene) = Scene::with_box() else { return };
    let plain = scene.shoot();
    let (image, target) = scene.add_target();
    let pose = Transform::from_xyz(0.0, HEIGHT, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z);
    let clear = Camera { clear_color: Color::BLACK.into(), ..default() };
    // The engine's default tone mapping needs tables that this build leaves out.
    scene.desk.app.world_mut().spawn((Camera3d::default(), clear, pose, target, Msaa::Off, Tonemapping::None));
    let shown = scene.shoot();
    scene.check("second_target", &shown, &plain);
    assert_eq!(shown.difference_at(&plain, IN_SHADOW), 0);
    let second = bevy_mirrorball::headless::read_texture(&mut scene.desk.app, &image).expect("it comes back");
    let second = Picture(second);
    second.save("second_target_itself");
    assert!(second.at(ON_TOP)[0] >= SEEN, "the box is missing in the second target: {:?}", second.at(ON_TOP));
    let corner = second.pixel(0);
    assert!(corner.into_iter().all(|channel| channel <= UNCHANGED), "the photograph is in a camera without one");
}
