//! Placement of entities in the world, wherever they are in the hierarchy.

use bevy::{ecs::system::SystemParam, prelude::*};

/// Reads and sets poses in world space, in meters. What was measured has no scale, so the scales of all parents are
/// left out of what is read and are undone in what is set.
#[derive(SystemParam)]
pub(super) struct Placement<'w, 's> {
    parents: Query<'w, 's, &'static ChildOf>,
    transforms: Query<'w, 's, &'static Transform>,
    global: TransformHelper<'w, 's>,
}

impl Placement<'_, '_> {
    /// Pose of an entity: its own frame of reference → world.
    pub(super) fn world_from(&self, entity: Entity) -> Option<Isometry3d> {
        self.global.compute_global_transform(entity).ok().map(|global| global.to_isometry())
    }

    /// Moves an entity to a pose in world space. Its own scale stays.
    pub(super) fn place(&self, commands: &mut Commands, entity: Entity, world_from_entity: Isometry3d) {
        let Ok(transform) = self.transforms.get(entity) else {
            return;
        };
        let parent = self.parents.get(entity).ok();
        let world_from_parent = parent.and_then(|parent| self.global.compute_global_transform(parent.parent()).ok());
        let Some(local) = local_pose(world_from_parent.as_ref(), world_from_entity) else {
            warn_once!("{entity} cannot be placed: a parent in the scene has a scale of 0");
            return;
        };
        let placed = Transform { scale: transform.scale, ..Transform::from_isometry(local) };
        if *transform != placed {
            commands.entity(entity).insert(placed);
        }
    }
}

/// Translation and rotation below a parent that result in a pose in world space. `None` if the parent has no inverse.
fn local_pose(world_from_parent: Option<&GlobalTransform>, world_from_entity: Isometry3d) -> Option<Isometry3d> {
    let Some(parent) = world_from_parent else {
        return Some(world_from_entity);
    };
    let affine = parent.affine();
    if affine.matrix3.determinant() == 0.0 {
        return None;
    }
    let translation = affine.inverse().transform_point3a(world_from_entity.translation);
    let local = Isometry3d::new(translation, parent.rotation().inverse() * world_from_entity.rotation);
    (local.translation.is_finite() && local.rotation.is_finite()).then_some(local)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parents_scale_does_not_move_what_is_placed() {
        let wanted = Isometry3d::new(Vec3::new(0.3, -0.2, 1.5), Quat::from_rotation_y(0.7));
        for scale in [Vec3::splat(0.01), Vec3::splat(2.0), Vec3::new(0.5, 2.0, 3.0)] {
            let parent =
                Transform::from_xyz(4.0, 5.0, -6.0).with_rotation(Quat::from_rotation_x(0.4)).with_scale(scale);
            let parent = GlobalTransform::from(parent);
            let local = local_pose(Some(&parent), wanted).expect("has an inverse");
            let placed = parent.mul_transform(Transform::from_isometry(local));
            assert!(placed.translation().distance(wanted.translation.into()) < 1e-5, "{scale}: {placed:?}");
            if scale.x == scale.y {
                assert!(placed.rotation().angle_between(wanted.rotation) < 1e-3, "{scale}: {placed:?}");
            }
        }
        assert_eq!(local_pose(Some(&Transform::from_scale(Vec3::ZERO).into()), wanted), None);
    }
}
