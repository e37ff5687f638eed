//! Rooms of thin walls under an even sky, and the light in them by path tracing.

use bevy::prelude::*;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// A block that reflects diffusely.
#[derive(Clone, Copy)]
pub(super) struct Wall {
    pub(super) center: Vec3,
    pub(super) half: Vec3,
    pub(super) albedo: Vec3,
}

/// Offset of a ray's start from the surface, in meters.
const ABOVE: f32 = 1e-4;

impl Wall {
    /// Distance at which a ray meets the wall, and the normal there.
    fn hit(&self, from: Vec3, dir: Vec3) -> Option<(f32, Vec3)> {
        let from = from - self.center;
        let (a, b) = ((-self.half - from) / dir, (self.half - from) / dir);
        let entries = a.min(b);
        let (near, far) = (entries.max_element(), a.max(b).min_element());
        let axis = Vec3::AXES[entries.max_position()];
        (near < far && near > 0.0).then(|| (near, -axis * dir.dot(axis).signum()))
    }
}

/// Cosine-weighted directions around a normal.
fn directions(normal: Vec3, count: u32) -> impl Iterator<Item = Vec3> {
    let (right, up) = normal.any_orthonormal_pair();
    (0..count).map(move |i| {
        let squared = (i as f32 + 0.5) / count as f32;
        let (sin, cos) = (i as f32 * 0.618_034 * TAU).sin_cos();
        squared.sqrt() * (cos * right + sin * up) + (1.0 - squared).sqrt() * normal
    })
}

/// Irradiance at a surface under an even sky of a radiance, all around, after at most so many reflections.
pub(super) fn irradiance(walls: &[Wall], sky: f32, pos: Vec3, normal: Vec3, bounces: u32) -> Vec3 {
    let count = [64, 64, 512][bounces as usize];
    let from = pos + ABOVE * normal;
    let light = |dir: Vec3| {
        let hits = walls.iter().filter_map(|wall| wall.hit(from, dir).map(|hit| (hit, wall)));
        match hits.min_by(|a, b| a.0.0.total_cmp(&b.0.0)) {
            None => Vec3::splat(sky),
            Some(_) if bounces == 0 => Vec3::ZERO,
            Some(((distance, normal), wall)) => {
                wall.albedo / PI * irradiance(walls, sky, from + distance * dir, normal, bounces - 1)
            }
        }
    };
    PI / count as f32 * directions(normal, count).map(light).sum::<Vec3>()
}

/// A floor with walls of some heights on its four sides, all of a meter's width.
pub(super) fn room(height: f32, albedo: Vec3) -> Vec<Wall> {
    let thick = 0.01;
    let wall = |side: usize| {
        let outwards = Quat::from_rotation_y(FRAC_PI_2 * side as f32) * Vec3::X;
        let center = (0.5 + thick) * outwards + 0.5 * height * Vec3::Y;
        let half = 0.5 * height * Vec3::Y + outwards.abs() * thick + outwards.zxy().abs().with_y(0.0) * 0.5;
        Wall { center, half, albedo }
    };
    let floor = Wall { center: -thick * Vec3::Y, half: Vec3::new(0.5, thick, 0.5), albedo };
    std::iter::once(floor).chain((0..4).map(wall)).collect()
}

#[test]
fn an_open_floor_receives_the_whole_sky_and_a_deep_room_gets_darker() {
    let open = irradiance(&room(0.0, Vec3::ONE)[..1], 0.5, Vec3::ZERO, Vec3::Y, 2);
    assert!(open.distance(Vec3::splat(0.5 * PI)) < 1e-3, "{open}");
    let at =
        |height: f32, bounces: u32| irradiance(&room(height, Vec3::splat(0.5)), 1.0, Vec3::ZERO, Vec3::Y, bounces).x;
    assert!(at(1.0, 0) < at(1.0, 1) && at(1.0, 1) < at(1.0, 2) && at(1.0, 2) < at(0.5, 2) && at(0.5, 2) < PI);
}
