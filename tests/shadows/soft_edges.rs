//! Soft edges of phantoms, against the part of a disc that a straight edge covers.

use crate::{
    desk::{INTRINSICS, SIZE},
    gpu,
};
use bevy::{camera::Hdr, prelude::*};
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels, srgb_to_linear},
    materials::{MaterialsPlugin, SoftPhantomEdges},
    offscreen,
    phantom::PhantomPlugin,
    prelude::*,
};

const REAL: u8 = 90;
const VIRTUAL: Color = Color::linear_rgb(0.6, 0.6, 0.6);
/// Columns are drawn, discs are sampled: how far the share of the virtual side may be off.
const TOLERANCE: f32 = 0.12;

struct Scene {
    app: App,
    picture: Handle<Image>,
    camera: Entity,
}

impl Scene {
    fn new(pose: Transform, extra: impl Bundle) -> Option<Self> {
        let mut app = gpu::app(|app| {
            app.add_plugins((CameraPlugin, PhantomPlugin, MaterialsPlugin));
        })?;
        let (picture, target) = offscreen::add_target(&mut app, SIZE);
        let pixels = [REAL, REAL, REAL, 255].repeat(SIZE.element_product() as usize);
        let pixels = FramePixels::new(SIZE, pixels).expect("as many bytes as the size says");
        let feed = CameraFeed::pixels(pixels).with_pace(FeedPace::Lockstep);
        let camera = app.world_mut().spawn((ArCamera::new(INTRINSICS), pose, feed, target, extra)).id();
        Some(Self { app, picture, camera })
    }

    fn add(&mut self, mesh: impl Into<Mesh>, place: Vec3, extra: impl Bundle) {
        let mesh = self.app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        self.app.world_mut().spawn((Mesh3d(mesh), Transform::from_translation(place), extra));
    }

    fn add_virtual(&mut self, mesh: impl Into<Mesh>, place: Vec3) {
        let surface = StandardMaterial { base_color: VIRTUAL, unlit: true, ..default() };
        let surface = self.app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(surface);
        self.add(mesh, place, (MeshMaterial3d(surface), SurfaceStyle::Engine));
    }

    fn shoot(&mut self) -> Vec<u8> {
        for _ in 0..4 {
            self.app.update();
        }
        offscreen::read_texture(&mut self.app, &self.picture).expect("the picture comes back")
    }

    fn soften(&mut self, radius: f32) {
        self.app.world_mut().entity_mut(self.camera).insert(SoftPhantomEdges { radius });
    }
}

/// Red of the middle row, linear.
fn middle_row(picture: &[u8]) -> Vec<f32> {
    let row = (SIZE.y / 2 * SIZE.x) as usize;
    (row..row + SIZE.x as usize).map(|pixel| srgb_to_linear(picture[4 * pixel])).collect()
}

/// A wall of a size, facing the camera.
fn wall(width: f32, height: f32) -> Mesh {
    Plane3d::new(Vec3::Z, 0.5 * Vec2::new(width, height)).into()
}

/// Part of a disc that is to the right of a line at a signed distance to the right of its middle, both in radii.
fn share_beyond(line: f32) -> f32 {
    let t = line.clamp(-1.0, 1.0);
    0.5 - (t * (1.0 - t * t).sqrt() + t.asin()) / std::f32::consts::PI
}

fn assert_fades(extra: impl Bundle, name: &str) {
    let Some(mut scene) = Scene::new(Transform::IDENTITY, extra) else { return };
    scene.add_virtual(wall(4.0, 4.0), Vec3::NEG_Z * 2.0);
    // Its right edge is in the middle of the picture.
    scene.add(wall(2.0, 4.0), Vec3::new(-1.0, 0.0, -1.0), PhantomObject::default());
    let sharp = middle_row(&scene.shoot());
    let (real, drawn) = (sharp[0], sharp[SIZE.x as usize - 1]);
    assert!((real - srgb_to_linear(REAL)).abs() < 0.01 && drawn > 2.0 * real, "{name}: {real} {drawn}");
    for radius in [2.0, 5.0] {
        scene.soften(radius);
        let soft = middle_row(&scene.shoot());
        let mut worst = 0.0_f32;
        for (column, value) in soft.iter().enumerate() {
            let line = (0.5 * SIZE.x as f32 - (column as f32 + 0.5)) / radius;
            worst = worst.max(((value - real) / (drawn - real) - share_beyond(line)).abs());
        }
        println!("{name}, radius {radius}: share of the virtual side at most {worst:.3} off");
        assert!(worst < TOLERANCE, "{name}: {soft:?}");
        assert!(soft.windows(2).all(|pair| pair[1] >= pair[0] - 0.04), "{name}: {soft:?}");
    }
}

#[test]
fn a_virtual_wall_fades_into_the_phantom_before_it() {
    assert_fades(Msaa::Off, "plain");
}

#[test]
fn edges_fade_under_multisampling_and_high_dynamic_range_too() {
    assert_fades((Msaa::Sample4, Hdr), "multisampled");
}

#[test]
fn what_is_before_a_phantom_or_stands_on_it_stays_sharp() {
    let Some(mut scene) = Scene::new(Transform::IDENTITY, Msaa::Off) else { return };
    scene.add(wall(8.0, 8.0), Vec3::NEG_Z * 2.0, PhantomObject::default());
    scene.add_virtual(wall(2.0, 4.0), Vec3::new(1.0, 0.0, -1.0));
    let sharp = scene.shoot();
    scene.soften(4.0);
    assert_eq!(scene.shoot(), sharp, "before it");

    let pose = Transform::from_xyz(0.3, 0.4, 0.6).looking_at(Vec3::ZERO, Vec3::Y);
    let Some(mut scene) = Scene::new(pose, Msaa::Off) else { return };
    scene.add(Plane3d::default().mesh().size(3.0, 3.0), Vec3::ZERO, PhantomObject::default());
    scene.add_virtual(Cuboid::from_length(0.2), Vec3::Y * 0.1);
    let sharp = scene.shoot();
    assert!(middle_row(&sharp).iter().any(|value| *value > 0.5), "the box is seen");
    scene.soften(4.0);
    assert_eq!(scene.shoot(), sharp, "on it");
}
