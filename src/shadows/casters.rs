//! What casts shadows, where it is and what shape it has.

use super::{dome::BoundingSphere, schedule::Movement};
use crate::stage::StageRole;
use bevy::{
    camera::primitives::Aabb,
    ecs::system::SystemParam,
    light::NotShadowCaster,
    math::Affine2,
    mesh::{
        morph::{MeshMorphWeights, MorphWeights},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};

/// Share of a skinned mesh's rest-pose radius that is taken to lie around each of its joints.
const FLESH: f32 = 0.3;

/// On a mesh that is cut out by its texture's alpha: how, so that its shadow has the same holes. Put there by the materials.
#[derive(Component, Clone, Debug, PartialEq)]
pub(crate) struct Cutout {
    pub(crate) texture: Handle<Image>,
    /// Alpha of the material, by which the texture's is multiplied.
    pub(crate) alpha: f32,
    /// Below this nothing is drawn.
    pub(crate) cutoff: f32,
    pub(crate) uv_transform: Affine2,
    /// Whether the texture is laid on by the mesh's second set of coordinates.
    pub(crate) uses_second_uv: bool,
}

/// A mesh as it is drawn into shadow maps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Caster {
    entity: Entity,
    pub(super) mesh: AssetId<Mesh>,
    pub(super) world_from_local: Mat4,
    pub(super) is_phantom: bool,
    pub(super) sphere: BoundingSphere,
    /// Of a skinned mesh: world from bind pose, per joint.
    pub(super) joints: Vec<Mat4>,
    /// Of a mesh with morph targets.
    pub(super) morph_weights: Vec<f32>,
    pub(super) cutout: Option<Cutout>,
}

/// How casters have moved since the last frame; `None` if not at all.
pub(super) fn movement(before: &[Caster], now: &[Caster]) -> Option<Movement> {
    if before == now {
        return None;
    }
    let mut movement = Movement::default();
    if before.len() != now.len() || before.iter().zip(now).any(|(a, b)| a.entity != b.entity) {
        before.iter().chain(now).for_each(|caster| movement.reshape(caster.sphere.radius));
        return Some(movement);
    }
    for (a, b) in before.iter().zip(now).filter(|(a, b)| a != b) {
        movement.shift(b.sphere.center - a.sphere.center);
        let moved = Mat4 { w_axis: b.world_from_local.w_axis, ..a.world_from_local };
        let shifted = Caster { world_from_local: moved, sphere: b.sphere, ..a.clone() };
        if shifted != *b {
            movement.reshape(b.sphere.radius);
        }
    }
    Some(movement)
}

type CasterItem = (
    Entity,
    &'static Mesh3d,
    &'static GlobalTransform,
    &'static Aabb,
    &'static StageRole,
    &'static InheritedVisibility,
    Option<&'static SkinnedMesh>,
    Option<&'static MeshMorphWeights>,
    Option<&'static Cutout>,
);

/// Everything that casts.
#[derive(SystemParam)]
pub(super) struct Casters<'w, 's> {
    meshes: Query<'w, 's, CasterItem, Without<NotShadowCaster>>,
    transforms: Query<'w, 's, &'static GlobalTransform>,
    morph_weights: Query<'w, 's, &'static MorphWeights>,
    bind_poses: Res<'w, Assets<SkinnedMeshInverseBindposes>>,
}

impl Casters<'_, '_> {
    pub(super) fn gather(&self) -> Vec<Caster> {
        self.meshes.iter().filter_map(|item| self.caster(item)).collect()
    }

    fn caster(
        &self,
        (entity, mesh, transform, aabb, role, visibility, skin, morph, cutout): (
            Entity,
            &Mesh3d,
            &GlobalTransform,
            &Aabb,
            &StageRole,
            &InheritedVisibility,
            Option<&SkinnedMesh>,
            Option<&MeshMorphWeights>,
            Option<&Cutout>,
        ),
    ) -> Option<Caster> {
        let is_phantom = match role {
            StageRole::Virtual => false,
            StageRole::Phantom(phantom) if phantom.casts => true,
            StageRole::Phantom(_) => return None,
        };
        if !visibility.get() {
            return None;
        }
        let world_from_local = transform.affine();
        let rest = BoundingSphere {
            center: world_from_local.transform_point3a(aabb.center).into(),
            radius: transform.radius_vec3a(aabb.half_extents),
        };
        let (joints, posed) = skin.map_or((vec![], None), |skin| self.joints(skin, rest.radius));
        let morph_weights = match morph {
            None => vec![],
            Some(MeshMorphWeights::Value { weights }) => weights.clone(),
            Some(MeshMorphWeights::Reference(other)) => {
                self.morph_weights.get(*other).map_or(vec![], |weights| weights.weights().to_vec())
            }
        };
        Some(Caster {
            entity,
            mesh: mesh.id(),
            world_from_local: world_from_local.into(),
            is_phantom,
            sphere: posed.unwrap_or(rest),
            joints,
            morph_weights,
            cutout: cutout.cloned(),
        })
    }

    /// The matrices of a skin's joints, and a sphere around the posed mesh. None of both while anything is missing.
    fn joints(&self, skin: &SkinnedMesh, rest_radius: f32) -> (Vec<Mat4>, Option<BoundingSphere>) {
        let Some(bind_poses) = self.bind_poses.get(&skin.inverse_bindposes) else {
            return (vec![], None);
        };
        let transforms: Vec<_> = self.transforms.iter_many(&skin.joints).map(|joint| joint.to_matrix()).collect();
        if transforms.len() != skin.joints.len() || bind_poses.len() < transforms.len() {
            return (vec![], None);
        }
        let flesh = FLESH * rest_radius;
        let spheres: Vec<_> = transforms
            .iter()
            .map(|joint| BoundingSphere { center: joint.w_axis.truncate(), radius: flesh })
            .collect();
        let matrices = transforms.iter().zip(bind_poses.iter()).map(|(joint, bind)| *joint * *bind).collect();
        (matrices, BoundingSphere::around(&spheres))
    }
}
