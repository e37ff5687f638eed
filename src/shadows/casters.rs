//! Meshes that cast shadows, with their transforms, bounds and poses.

use super::{bounding_sphere::BoundingSphere, refresh::Movement};
use crate::phantom::StageRole;
use bevy::{
    camera::{
        primitives::Aabb,
        visibility::{RenderLayers, VisibilityRange, VisibleEntityRanges},
    },
    ecs::{query::QueryData, system::SystemParam},
    light::NotShadowCaster,
    math::{Affine2, BVec3A, Vec3A},
    mesh::{
        morph::{MeshMorphWeights, MorphAttributes, MorphWeights},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    pbr::decal::ForwardDecal,
    platform::collections::HashMap,
    prelude::*,
};

/// Alpha mask of a mesh, so that its shadow has the same holes. The materials insert it on meshes with
/// [`AlphaMode::Mask`].
#[derive(Component, Clone, Debug, PartialEq)]
pub(crate) struct AlphaMask {
    pub(crate) texture: Handle<Image>,
    /// Alpha of the material, which is multiplied with that of the texture.
    pub(crate) alpha: f32,
    /// Minimum alpha of what is drawn.
    pub(crate) cutoff: f32,
    pub(crate) uv_transform: Affine2,
    /// Whether the texture uses the mesh's second set of texture coordinates.
    pub(crate) uses_second_uv: bool,
}

/// A mesh to draw into shadow maps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Caster {
    pub(super) entity: Entity,
    pub(super) mesh: AssetId<Mesh>,
    pub(super) world_from_local: Mat4,
    pub(super) is_phantom: bool,
    pub(super) sphere: BoundingSphere,
    /// World from bind pose per joint of a skinned mesh; empty for other meshes.
    pub(super) joints: Vec<Mat4>,
    /// Weights of the morph targets; empty for a mesh without any.
    pub(super) morph_weights: Vec<f32>,
    pub(super) alpha_mask: Option<AlphaMask>,
}

/// Returns the movement of casters since the last frame, or `None` if nothing has changed.
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

#[derive(QueryData)]
pub(super) struct CasterData {
    entity: Entity,
    mesh: &'static Mesh3d,
    transform: &'static GlobalTransform,
    aabb: &'static Aabb,
    role: &'static StageRole,
    visibility: &'static InheritedVisibility,
    layers: Option<&'static RenderLayers>,
    has_range: Has<VisibilityRange>,
    skin: Option<&'static SkinnedMesh>,
    morph: Option<&'static MeshMorphWeights>,
    alpha_mask: Option<&'static AlphaMask>,
}

/// System parameter that collects all casters. Decals are meshes too, but paint on others.
#[derive(SystemParam)]
pub(super) struct Casters<'w, 's> {
    meshes: Query<'w, 's, CasterData, (Without<NotShadowCaster>, Without<ForwardDecal>)>,
    cameras: Query<'w, 's, (Entity, &'static Camera)>,
    ranges: Option<Res<'w, VisibleEntityRanges>>,
    transforms: Query<'w, 's, &'static GlobalTransform>,
    morph_weights: Query<'w, 's, &'static MorphWeights>,
    bind_poses: Res<'w, Assets<SkinnedMeshInverseBindposes>>,
    mesh_data: Res<'w, Assets<Mesh>>,
    mesh_changes: MessageReader<'w, 's, AssetEvent<Mesh>>,
    morph_reach: Local<'s, HashMap<AssetId<Mesh>, Vec<f32>>>,
}

impl Casters<'_, '_> {
    /// Returns all visible casters that share a layer with the dome, sorted by their entities: a mesh that gets another
    /// material changes its place among the entities, but not what it casts.
    pub(super) fn gather(&mut self, dome_layers: Option<&RenderLayers>) -> Vec<Caster> {
        for change in self.mesh_changes.read() {
            if let AssetEvent::Modified { id } | AssetEvent::Removed { id } = change {
                self.morph_reach.remove(id);
            }
        }
        let morphed = self.meshes.iter().filter(|item| item.morph.is_some());
        for id in morphed.map(|item| item.mesh.id()) {
            self.morph_reach.entry(id).or_insert_with(|| morph_reach(self.mesh_data.get(id)));
        }
        let layers = dome_layers.unwrap_or_default();
        let is_lit = |item: &CasterDataItem| item.layers.unwrap_or_default().intersects(layers);
        let mut casters: Vec<_> = self.meshes.iter().filter(is_lit).filter_map(|item| self.caster(item)).collect();
        casters.sort_unstable_by_key(|caster| caster.entity);
        casters
    }

    /// Returns whether an entity is in its visibility range for any active camera.
    fn is_in_range(&self, entity: Entity) -> bool {
        let Some(ranges) = &self.ranges else {
            return true;
        };
        let active = self.cameras.iter().filter(|(_, camera)| camera.is_active);
        active.map(|(camera, _)| camera).any(|camera| ranges.entity_is_in_range_of_view(entity, camera))
    }

    /// Returns the maximum distance by which weights move vertices out of the rest pose, in units of the mesh.
    fn reach(&self, mesh: AssetId<Mesh>, weights: &[f32]) -> f32 {
        let reach = self.morph_reach.get(&mesh).map_or(&[][..], Vec::as_slice);
        weights.iter().zip(reach).map(|(weight, reach)| weight.abs() * reach).sum()
    }

    fn caster(&self, item: CasterDataItem) -> Option<Caster> {
        let is_phantom = match item.role {
            StageRole::Virtual => false,
            StageRole::Phantom(phantom) if phantom.casts => true,
            StageRole::Phantom(_) => return None,
        };
        if !item.visibility.get() || (item.has_range && !self.is_in_range(item.entity)) {
            return None;
        }
        let (mesh, world_from_local) = (item.mesh.id(), item.transform.affine());
        let morph_weights = item.morph.map_or(vec![], |morph| self.morph_weights(morph));
        let aabb = Aabb { half_extents: item.aabb.half_extents + self.reach(mesh, &morph_weights), ..*item.aabb };
        let rest = BoundingSphere {
            center: world_from_local.transform_point3a(aabb.center).into(),
            radius: item.transform.radius_vec3a(aabb.half_extents),
        };
        let (joints, posed) = item.skin.map_or((vec![], None), |skin| self.joints(skin, &aabb));
        Some(Caster {
            entity: item.entity,
            mesh,
            world_from_local: world_from_local.into(),
            is_phantom,
            sphere: posed.unwrap_or(rest),
            joints,
            morph_weights,
            alpha_mask: item.alpha_mask.cloned(),
        })
    }

    fn morph_weights(&self, morph: &MeshMorphWeights) -> Vec<f32> {
        match morph {
            MeshMorphWeights::Value { weights } => weights.clone(),
            MeshMorphWeights::Reference(other) => {
                self.morph_weights.get(*other).map_or(vec![], |weights| weights.weights().to_vec())
            }
        }
    }

    /// Returns the matrices of a skin's joints and a sphere around the posed mesh, or neither while anything is
    /// missing.
    ///
    /// The reach of the mesh around each joint comes from the rest pose: it is the largest distance of a corner of the
    /// bounding box from its nearest joint.
    fn joints(&self, skin: &SkinnedMesh, rest: &Aabb) -> (Vec<Mat4>, Option<BoundingSphere>) {
        let Some(bind_poses) = self.bind_poses.get(&skin.inverse_bindposes) else {
            return (vec![], None);
        };
        let transforms: Vec<_> = self.transforms.iter_many(&skin.joints).map(|joint| joint.to_matrix()).collect();
        if transforms.len() != skin.joints.len() || bind_poses.len() < transforms.len() {
            return (vec![], None);
        }
        let matrices: Vec<Mat4> =
            transforms.iter().zip(bind_poses.iter()).map(|(joint, bind)| *joint * *bind).collect();
        let at_rest: Vec<Vec3> = bind_poses.iter().map(|bind| bind.inverse().w_axis.truncate()).collect();
        let reach = (0..8).map(|corner| {
            let side =
                Vec3A::select(BVec3A::new(corner & 1 > 0, corner & 2 > 0, corner & 4 > 0), Vec3A::ONE, Vec3A::NEG_ONE);
            let corner = Vec3::from(rest.center + side * rest.half_extents);
            at_rest.iter().map(|joint| joint.distance(corner)).fold(f32::MAX, f32::min)
        });
        let reach = reach.fold(0.0, f32::max);
        let scale =
            |matrix: &Mat4| Mat3::from_mat4(*matrix).to_cols_array_2d().map(|c| Vec3::from(c).length()).into_iter();
        let spheres: Vec<_> = transforms
            .iter()
            .zip(&matrices)
            .map(|(joint, matrix)| BoundingSphere {
                center: joint.w_axis.truncate(),
                radius: reach * scale(matrix).fold(0.0, f32::max),
            })
            .collect();
        (matrices, BoundingSphere::around(&spheres))
    }
}

/// Returns the longest displacement of each morph target of a mesh.
fn morph_reach(mesh: Option<&Mesh>) -> Vec<f32> {
    // The data of a mesh that is only on the GPU cannot be read.
    let Some((targets, vertices)) = mesh.and_then(|mesh| Some((mesh.try_morph_targets().ok()?, mesh.count_vertices())))
    else {
        return vec![];
    };
    let longest = |target: &[MorphAttributes]| target.iter().map(|vertex| vertex.position.length()).fold(0.0, f32::max);
    targets.chunks(vertices.max(1)).map(longest).collect()
}
