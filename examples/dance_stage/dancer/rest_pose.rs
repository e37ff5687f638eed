//! How large the figure of a glTF file is, and how it fits on the stage.
//!
//! A loaded file enters, a transform leaves. Skinned meshes are as large as their bones let them be: glTF 2.0 ignores
//! the transform of their nodes (Khronos Group 2021, section 3.7.3.1).

use bevy::{
    ecs::system::SystemParam,
    gltf::{Gltf, GltfMesh, GltfNode, GltfSkin},
    math::bounding::Aabb3d,
    mesh::{VertexAttributeValues, skinning::SkinnedMeshInverseBindposes},
    platform::collections::HashMap,
    prelude::*,
};
use std::f32::consts::PI;

/// Height of a dancer on a desk in meters.
const HEIGHT: f32 = 0.15;
/// Largest width and length of a dancer in meters: a little more than those of the stage.
const MAX_WIDTH: f32 = 0.2;
/// Ratio to this height up to which a figure counts as made for the stage.
const TOLERANCE: f32 = 1.4;

/// The parts of glTF files.
#[derive(SystemParam)]
pub(crate) struct FigureParts<'w> {
    nodes: Res<'w, Assets<GltfNode>>,
    gltf_meshes: Res<'w, Assets<GltfMesh>>,
    skins: Res<'w, Assets<GltfSkin>>,
    inverse_bindposes: Res<'w, Assets<SkinnedMeshInverseBindposes>>,
    meshes: Res<'w, Assets<Mesh>>,
}

/// Transforms of nodes from their file, without animation.
type RestPose = HashMap<AssetId<GltfNode>, Mat4>;

impl FigureParts<'_> {
    /// Returns the transform that puts a figure on its feet in the middle of the stage, as tall as a dancer; `None` if
    /// it has no vertices. One made for the stage (`is_native`) that is about as tall stays as it is. It faces −Z, to
    /// the audience; others face +Z, as glTF says.
    pub(crate) fn fit(&self, file: &Gltf, is_native: bool) -> Option<Transform> {
        let bounds = self.bounds(file)?;
        let size = Vec3::from(bounds.max - bounds.min);
        if is_native && (HEIGHT / TOLERANCE..HEIGHT * TOLERANCE).contains(&size.y) {
            return Some(Transform::IDENTITY);
        }
        let scale = (HEIGHT / size.y).min(MAX_WIDTH / size.x.max(size.z)).min(f32::MAX);
        let feet = Vec3::from((bounds.min + bounds.max) / 2.0).with_y(bounds.min.y);
        let rotation = Quat::from_rotation_y(if is_native { 0.0 } else { PI });
        Some(Transform { translation: rotation * (feet * -scale), rotation, scale: Vec3::splat(scale) })
    }

    /// Bounds of all vertices.
    fn bounds(&self, file: &Gltf) -> Option<Aabb3d> {
        let pose = self.rest_pose(file);
        let mut points = Vec::new();
        for handle in &file.nodes {
            let Some(node) = self.nodes.get(handle) else { continue };
            let joints = node.skin.as_ref().and_then(|skin| self.joints(skin, &pose));
            let mesh = node.mesh.as_ref().and_then(|mesh| self.gltf_meshes.get(mesh));
            let meshes = mesh.into_iter().flat_map(|mesh| &mesh.primitives);
            for mesh in meshes.filter_map(|primitive| self.meshes.get(&primitive.mesh)) {
                let transform = pose.get(&handle.id()).copied().unwrap_or_default();
                points.extend(vertices(mesh, transform, joints.as_deref()).into_iter().flatten());
            }
        }
        (!points.is_empty()).then(|| Aabb3d::from_point_cloud(Isometry3d::IDENTITY, points.into_iter()))
    }

    fn rest_pose(&self, file: &Gltf) -> RestPose {
        let nodes = || file.nodes.iter().filter_map(|handle| Some((handle.id(), self.nodes.get(handle)?)));
        let parents: HashMap<_, _> =
            nodes().flat_map(|(id, node)| node.children.iter().map(move |child| (child.id(), id))).collect();
        let locals: HashMap<_, _> = nodes().map(|(id, node)| (id, node.transform.to_matrix())).collect();
        let global = |id| {
            let mut path = std::iter::successors(Some(id), |id| parents.get(id).copied());
            // glTF files whose nodes are their own ancestors are not loaded.
            path.by_ref().take(locals.len()).fold(Mat4::IDENTITY, |global, id| locals[&id] * global)
        };
        locals.keys().map(|id| (*id, global(*id))).collect()
    }

    /// Matrices of the joints of a skin.
    fn joints(&self, skin: &Handle<GltfSkin>, pose: &RestPose) -> Option<Vec<Mat4>> {
        let skin = self.skins.get(skin)?;
        let inverses = self.inverse_bindposes.get(&skin.inverse_bind_matrices)?;
        let joints = skin.joints.iter().zip(inverses.iter());
        Some(joints.map(|(joint, inverse)| pose.get(&joint.id()).copied().unwrap_or_default() * *inverse).collect())
    }
}

/// Vertices of a mesh in the rest pose. `None` without positions.
fn vertices(mesh: &Mesh, transform: Mat4, joints: Option<&[Mat4]>) -> Option<Vec<Vec3>> {
    let positions = mesh.try_attribute(Mesh::ATTRIBUTE_POSITION).ok()?.as_float3()?;
    let positions = positions.iter().copied().map(Vec3::from);
    let skinning = joints.and_then(|joints| {
        let indices = mesh.try_attribute(Mesh::ATTRIBUTE_JOINT_INDEX).ok()?;
        let weights = mesh.try_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT).ok()?;
        match (indices, weights) {
            (VertexAttributeValues::Uint16x4(indices), VertexAttributeValues::Float32x4(weights)) => {
                Some((joints, indices, weights))
            }
            _ => None,
        }
    });
    Some(match skinning {
        None => positions.map(|position| transform.transform_point3(position)).collect(),
        Some((joints, indices, weights)) => {
            let skinned = |(position, (indices, weights)): (Vec3, (&[u16; 4], &[f32; 4]))| {
                let moved = |(index, weight): (&u16, &f32)| {
                    let joint = joints.get(usize::from(*index)).copied().unwrap_or_default();
                    joint.transform_point3(position) * *weight
                };
                indices.iter().zip(weights).map(moved).sum()
            };
            positions.zip(indices.iter().zip(weights)).map(skinned).collect()
        }
    })
}
