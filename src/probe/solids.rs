//! Solids: boxes around real objects, which hide a ball from the camera or stand where the ball cannot show them.
//!
//! A phantom counts as the box around its mesh, in the mesh's own axes. That is exact for desks and boxes, and a
//! little too large for anything round. WGSL twin: `solids.wgsl`.

use crate::phantom::{PhantomObject, StageRole};
use bevy::{camera::primitives::Aabb, math::Affine3A, prelude::*, render::render_resource::ShaderType};

/// Lower bound of a box's half size in meters, which gives planes a thickness.
const MIN_HALF_SIZE: f32 = 1e-4;

/// Box in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Solid {
    /// Map from world space to the cube −1…1.
    unit_from_world: Affine3A,
    center: Vec3,
    /// Radius of the bounding sphere, in meters.
    radius: f32,
    /// Whether the box hides a ball behind it.
    blocks: bool,
    /// Whether the camera's view of the box can replace the ball's.
    shows: bool,
}

/// Mirror of `Solid` in `solids.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, PartialEq)]
pub(crate) struct SolidUniform {
    x: Vec4,
    y: Vec4,
    z: Vec4,
}

impl SolidUniform {
    /// Box that no ray hits, far behind the camera.
    pub(crate) const NOTHING: Self = Self {
        x: Vec4::new(1e6, 0.0, 0.0, 1e12),
        y: Vec4::new(0.0, 1e6, 0.0, 1e12),
        z: Vec4::new(0.0, 0.0, 1e6, -1e12),
    };
}

impl Solid {
    pub(super) fn new(world_from_mesh: Affine3A, bounds: &Aabb, role: PhantomObject) -> Option<Self> {
        let center = world_from_mesh.transform_point3a(bounds.center);
        let axes = [0, 1, 2].map(|i| {
            let axis = world_from_mesh.matrix3.col(i) * bounds.half_extents[i];
            axis.length().max(MIN_HALF_SIZE) * world_from_mesh.matrix3.col(i).normalize_or_zero()
        });
        let world_from_unit =
            Affine3A { matrix3: bevy::math::Mat3A::from_cols(axes[0], axes[1], axes[2]), translation: center };
        let unit_from_world = world_from_unit.inverse();
        unit_from_world.is_finite().then(|| Self {
            unit_from_world,
            center: center.into(),
            radius: (axes[0].length_squared() + axes[1].length_squared() + axes[2].length_squared()).sqrt(),
            blocks: role.casts,
            shows: role.receives,
        })
    }

    /// Whether a point lies inside the box. The center of a ball lies inside the phantom of that ball.
    fn contains(&self, point: Vec3) -> bool {
        self.unit_from_world.transform_point3(point).abs().max_element() <= 1.0
    }

    fn uniform(&self, world_from_camera: &Affine3A) -> SolidUniform {
        let rows = Mat4::from(self.unit_from_world * *world_from_camera).transpose();
        SolidUniform { x: rows.x_axis, y: rows.y_axis, z: rows.z_axis }
    }
}

/// Solids around one ball, in camera space.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Surroundings {
    /// Solids that may come between the camera and the ball.
    pub blockers: Vec<SolidUniform>,
    /// Solids that the ball mirrors.
    pub shown: Vec<SolidUniform>,
}

impl Surroundings {
    pub(super) fn new(solids: &[Solid], camera_from_world: &Affine3A, center: Vec3, radius: f32) -> Self {
        let world_from_camera = camera_from_world.inverse();
        let eye = Vec3::from(world_from_camera.translation);
        let line = center - eye;
        let is_between = |solid: &Solid| {
            let along = ((solid.center - eye).dot(line) / line.length_squared()).clamp(0.0, 1.0);
            (solid.center - eye - along * line).length() < solid.radius + 2.0 * radius
        };
        let around = || solids.iter().filter(|solid| !solid.contains(center));
        let uniform = |solid: &Solid| solid.uniform(&world_from_camera);
        Self {
            blockers: around().filter(|solid| solid.blocks && is_between(solid)).map(uniform).collect(),
            shown: around().filter(|solid| solid.shows).map(uniform).collect(),
        }
    }

    /// Visibility of a point (camera space) from the camera, 0…1. It falls off over `margin` meters beside a blocker.
    pub(super) fn visibility_of(&self, point: Vec3, margin: f32) -> f32 {
        self.blockers.iter().map(|solid| 1.0 - solid.hidden_share(margin, point)).product()
    }
}

impl SolidUniform {
    /// Interval of a ray inside the box scaled by `grown`. Twin of `inside_of` in `solids.wgsl`.
    fn inside_of(&self, grown: Vec3, origin: Vec3, dir: Vec3) -> Vec2 {
        let map = |v: Vec4| Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v));
        let from = map(origin.extend(1.0));
        let along = map(dir.extend(0.0)).map(|a| if a.abs() < 1e-9 { 1e-9 } else { a });
        let (a, b) = ((-grown - from) / along, (grown - from) / along);
        Vec2::new(a.min(b).max_element(), a.max(b).min_element())
    }

    /// Fraction of the view from the camera to a point that the box hides, 0…1. Twin of `hidden_share` in
    /// `solids.wgsl`.
    fn hidden_share(&self, margin: f32, point: Vec3) -> f32 {
        let scale = [self.x, self.y, self.z].map(|row| row.truncate().length());
        let span = self.inside_of(Vec3::ONE + margin * Vec3::from_array(scale), Vec3::ZERO, point);
        let chord = (span.y.min(1.0) - span.x.max(0.0)) * point.length();
        (chord / (2.0 * margin)).clamp(0.0, 1.0)
    }
}

/// Solids of all phantoms that have a mesh.
pub(super) fn solids_of<'a>(
    phantoms: impl Iterator<Item = (&'a StageRole, &'a Aabb, &'a GlobalTransform)>,
) -> Vec<Solid> {
    let solid = |(role, bounds, place): (&StageRole, &Aabb, &GlobalTransform)| match role {
        StageRole::Phantom(phantom) => Solid::new(place.affine(), bounds, *phantom),
        StageRole::Virtual => None,
    };
    phantoms.filter_map(solid).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn box_at(center: Vec3, half: Vec3) -> Solid {
        let bounds = Aabb { center: Vec3::ZERO.into(), half_extents: half.into() };
        Solid::new(Affine3A::from_translation(center), &bounds, PhantomObject::default()).expect("has a size")
    }

    #[test]
    fn a_box_before_the_ball_hides_what_is_behind_it_and_softly_what_is_beside() {
        let solid = box_at(Vec3::new(0.02, 0.0, -0.4), Vec3::new(0.02, 0.1, 0.02));
        let around = Surroundings::new(&[solid], &Affine3A::IDENTITY, Vec3::new(0.0, 0.0, -0.8), 0.05);
        let view = |x: f32| around.visibility_of(Vec3::new(x, 0.0, -0.8), 0.005);
        assert_eq!((view(0.03), view(-0.03)), (0.0, 1.0));
        // The nearer edge, at 0.38 m, covers x < 0 at the ball; beside it the view opens within some millimeters.
        let opening: Vec<f32> = (0..10).map(|i| view(-0.0015 * i as f32)).collect();
        assert!(
            opening.windows(2).all(|w| w[1] >= w[0]) && opening.iter().any(|v| (0.1..0.9).contains(v)),
            "{opening:?}"
        );
        let behind = Surroundings::new(
            &[box_at(Vec3::new(0.0, 0.0, -1.5), Vec3::splat(0.1))],
            &Affine3A::IDENTITY,
            Vec3::new(0.0, 0.0, -0.8),
            0.05,
        );
        assert!(behind.blockers.is_empty() && behind.shown.len() == 1);
        assert_eq!(around.visibility_of(Vec3::new(0.03, 0.0, -0.2), 0.005), 1.0, "before the box");
    }

    #[test]
    fn the_balls_own_stand_in_is_not_around_it() {
        let solid = box_at(Vec3::new(0.0, 0.0, -0.8), Vec3::splat(0.05));
        let around = Surroundings::new(&[solid], &Affine3A::IDENTITY, Vec3::new(0.0, 0.0, -0.8), 0.05);
        assert_eq!(around, Surroundings::default());
        assert_eq!(SolidUniform::NOTHING.hidden_share(0.01, Vec3::new(0.1, 0.1, -3.0)), 0.0);
    }
}
