//! Objects on a desk, and the light that reaches each place between them by ray casting.

use crate::desk::{Desk, HEIGHT, INTRINSICS, SIZE, Shot};
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// Directions of the reference.
pub(crate) const RAYS: u32 = 4096;
/// Edge of the cubes that environments are put into.
pub(crate) const CUBE_EDGE: u32 = 128;

#[derive(Clone, Copy)]
pub(crate) enum Shape {
    /// Half of its extents.
    Block(Vec3),
    Ball(f32),
}

#[derive(Clone, Copy)]
pub(crate) struct Thing {
    pub(crate) shape: Shape,
    pub(crate) center: Vec3,
    pub(crate) is_real: bool,
}

impl Thing {
    pub(crate) fn mesh(&self) -> Mesh {
        match self.shape {
            Shape::Block(half) => Cuboid::from_size(2.0 * half).into(),
            Shape::Ball(radius) => Sphere::new(radius).mesh().ico(16).expect("few enough"),
        }
    }

    /// Whether a ray meets the thing.
    pub(crate) fn blocks(&self, from: Vec3, dir: Vec3) -> bool {
        let from = from - self.center;
        match self.shape {
            Shape::Ball(radius) => {
                let along = from.dot(dir);
                along < 0.0 && from.length_squared() - along * along < radius * radius
            }
            Shape::Block(half) => {
                let (a, b) = ((-half - from) / dir, (half - from) / dir);
                let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
                near < far && far > 0.0
            }
        }
    }
}

/// A few things of 3 to 16 cm, one of them real, one that does not touch the desk.
pub(crate) fn things() -> Vec<Thing> {
    let thing = |shape, x, y, z, is_real| Thing { shape, center: Vec3::new(x, y, z), is_real };
    vec![
        thing(Shape::Block(Vec3::new(0.03, 0.05, 0.04)), -0.12, 0.05, 0.02, false),
        thing(Shape::Ball(0.03), 0.05, 0.03, -0.08, false),
        thing(Shape::Ball(0.025), 0.03, 0.12, 0.10, false),
        thing(Shape::Block(Vec3::new(0.04, 0.08, 0.01)), 0.15, 0.08, 0.03, true),
    ]
}

/// Evenly spread directions above the horizon, each with the light that comes from there.
pub(crate) fn sky(light: impl Fn(Vec3) -> Vec3) -> Vec<(Vec3, Vec3)> {
    let direction = |i: u32| {
        let height = (i as f32 + 0.5) / RAYS as f32;
        let across = (1.0 - height * height).sqrt();
        // The golden ratio's share of a turn between successive directions.
        let (sin, cos) = (i as f32 * 0.618_034 * std::f32::consts::TAU).sin_cos();
        Vec3::new(across * cos, height, across * sin)
    };
    (0..RAYS).map(direction).map(|dir| (dir, light(dir))).collect()
}

/// Camera × this is what the desk looks like with the virtual things on it.
pub(crate) fn true_ratio(things: &[Thing], sky: &[(Vec3, Vec3)], place: Vec3) -> Vec3 {
    let (mut before, mut after) = (Vec3::ZERO, Vec3::ZERO);
    for (dir, light) in sky {
        let blocked = |is_real| things.iter().any(|thing| thing.is_real == is_real && thing.blocks(place, *dir));
        if !blocked(true) {
            before += *light * dir.y;
            after += if blocked(false) { Vec3::ZERO } else { *light * dir.y };
        }
    }
    after / before.max(Vec3::splat(1e-9))
}

/// Places on the desk that the camera sees through the middles of pixels and that lie no nearer than a pixel to a
/// thing's edge.
pub(crate) fn places(things: &[Thing]) -> Vec<Vec3> {
    let camera = Vec3::new(0.0, HEIGHT, 0.0);
    let place = |x: f32, y: f32| {
        let on_desk = (Vec2::new(x, y) - INTRINSICS.center) / INTRINSICS.focal * HEIGHT;
        Vec3::new(on_desk.x, 0.0, on_desk.y)
    };
    let is_seen = |place: Vec3| !things.iter().any(|thing| thing.blocks(camera, (place - camera).normalize()));
    let pixels = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| Vec2::new(x as f32 + 0.5, y as f32 + 0.5)));
    pixels
        .filter(|pixel| {
            [-1.0, 0.0, 1.0]
                .iter()
                .all(|dx| [-1.0, 0.0, 1.0].iter().all(|dy| is_seen(place(pixel.x + dx, pixel.y + dy))))
        })
        .map(|pixel| place(pixel.x, pixel.y))
        .collect()
}

pub(crate) struct Errors {
    pub(crate) rms: f32,
    pub(crate) worst: f32,
    /// Over those places only where at least a twentieth of the light is missing.
    pub(crate) rms_in_shadow: f32,
}

pub(crate) fn compare(shot: &Shot, truth: &[(Vec3, Vec3)]) -> Errors {
    let (mut sum, mut worst, mut in_shadow, mut count_in_shadow) = (0.0, 0.0f32, 0.0, 0);
    for (place, expected) in truth {
        let error = shot.ratio(*place) - expected.y;
        sum += error * error;
        worst = worst.max(error.abs());
        if expected.y < 0.95 {
            in_shadow += error * error;
            count_in_shadow += 1;
        }
    }
    let rms = |sum: f32, count: usize| (sum / count.max(1) as f32).sqrt();
    Errors { rms: rms(sum, truth.len()), worst, rms_in_shadow: rms(in_shadow, count_in_shadow) }
}

pub(crate) fn furnished_desk() -> Option<Desk> {
    let mut desk = Desk::new()?;
    for thing in things() {
        if thing.is_real {
            desk.add(thing.mesh(), thing.center, PhantomObject { receives: false, ..default() });
        } else {
            desk.add_virtual(thing.mesh(), thing.center);
        }
    }
    Some(desk)
}

/// Sets a dome without bounced light, which rays that only look for the sky do not have.
pub(crate) fn set_dome(desk: &mut Desk, dome: ShadowDomeLight) {
    let dome = ShadowDomeLight { surfels: 0, ..dome };
    desk.app.world_mut().entity_mut(desk.dome).insert(dome);
}

pub(crate) fn truth(things: &[Thing], sky: &[(Vec3, Vec3)]) -> Vec<(Vec3, Vec3)> {
    places(things).into_iter().map(|place| (place, true_ratio(things, sky, place))).collect()
}
