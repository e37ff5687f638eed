//! The scene: toy cars that drive in a corner of two walls, around a sign.

use crate::Lab;
use bevy::{light::NotShadowCaster, prelude::*};
use std::f32::consts::TAU;

/// Half the edge of the floor, in meters.
pub(crate) const FLOOR: f32 = 1.7;

/// Circular path of a car: radius in meters, speed in radians per second, start in radians.
#[derive(Component, Clone, Copy)]
pub(crate) struct Drives {
    radius: f32,
    turn: f32,
    start: f32,
}

/// Spawns what is always there.
pub(crate) fn spawn_scene(world: &mut World) {
    let mut add = Builder(world);
    let (floor, wall) = (Color::srgb(0.75, 0.72, 0.68), Color::srgb(0.8, 0.8, 0.78));
    let ground = add.part(Plane3d::default().mesh().size(2.0 * FLOOR, 2.0 * FLOOR), Vec3::ZERO, floor);
    // It lies below all receivers.
    add.0.entity_mut(ground).insert(NotShadowCaster);
    add.part(Cuboid::new(3.0, 1.0, 0.08), Vec3::new(0.0, 0.5, -1.44), wall);
    add.part(Cuboid::new(0.08, 1.0, 2.8), Vec3::new(-1.46, 0.5, 0.0), wall);
    let pole = add.part(Cylinder::new(0.02, 0.9), Vec3::new(0.05, 0.45, -0.05), Color::srgb(0.45, 0.46, 0.48));
    let sign = add.part(Cylinder::new(0.2, 0.02), Vec3::new(0.0, 0.42, 0.03), Color::srgb(0.8, 0.1, 0.08));
    let bar = add.part(Cuboid::new(0.26, 0.03, 0.06), Vec3::new(0.0, 0.01, 0.0), Color::WHITE);
    let towards_camera = Quat::from_rotation_y(0.6) * Quat::from_rotation_x(TAU / 4.0);
    add.0.entity_mut(bar).insert(ChildOf(sign));
    add.0.entity_mut(sign).insert((ChildOf(pole), Transform::from_xyz(0.02, 0.42, 0.03).with_rotation(towards_camera)));
    for (paint, radius, turn, start) in [
        (Color::srgb(0.85, 0.2, 0.1), 0.95, 0.8, 0.3),
        (Color::srgb(0.1, 0.35, 0.75), 0.95, 0.8, 2.6),
        (Color::srgb(0.95, 0.75, 0.15), 0.52, -1.3, 4.4),
    ] {
        let car = add.car(paint);
        add.0.entity_mut(car).insert(Drives { radius, turn, start });
    }
}

/// Spawns objects with one color each.
struct Builder<'w>(&'w mut World);

impl Builder<'_> {
    fn part(&mut self, mesh: impl Into<Mesh>, place: Vec3, base_color: Color) -> Entity {
        let mesh = self.0.resource_mut::<Assets<Mesh>>().add(mesh);
        let material = StandardMaterial { base_color, perceptual_roughness: 0.6, ..default() };
        let material = self.0.resource_mut::<Assets<StandardMaterial>>().add(material);
        self.0.spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::from_translation(place))).id()
    }

    /// Spawns a toy car, 36 cm long, that faces +X.
    fn car(&mut self, paint: Color) -> Entity {
        let car = self.0.spawn((Transform::default(), Visibility::default())).id();
        let glass = Color::srgb(0.12, 0.14, 0.18);
        let mut parts = vec![
            self.part(Cuboid::new(0.36, 0.07, 0.17), Vec3::new(0.0, 0.085, 0.0), paint),
            self.part(Cuboid::new(0.18, 0.07, 0.14), Vec3::new(-0.03, 0.15, 0.0), glass),
            self.part(Cuboid::new(0.17, 0.015, 0.145), Vec3::new(-0.03, 0.19, 0.0), paint),
        ];
        for (x, z) in [(0.11, 0.08), (0.11, -0.08), (-0.11, 0.08), (-0.11, -0.08)] {
            let wheel = self.part(Cylinder::new(0.05, 0.035), Vec3::ZERO, Color::srgb(0.06, 0.06, 0.06));
            let upright = Transform::from_xyz(x, 0.05, z).with_rotation(Quat::from_rotation_x(TAU / 4.0));
            self.0.entity_mut(wheel).insert(upright);
            parts.push(wheel);
        }
        self.0.entity_mut(car).add_children(&parts);
        car
    }
}

pub(crate) fn drive(lab: Res<Lab>, mut cars: Query<(&Drives, &mut Transform)>) {
    for (Drives { radius, turn, start }, mut transform) in &mut cars {
        let angle = start + turn * lab.time;
        let place = radius * Vec3::new(angle.cos(), 0.0, angle.sin());
        // The tangent is a quarter turn from the radius.
        let heading = -angle - turn.signum() * 0.25 * TAU;
        let now = Transform::from_translation(place).with_rotation(Quat::from_rotation_y(heading));
        // An unchanged transform does not trigger new shadow maps.
        transform.set_if_neq(now);
    }
}
