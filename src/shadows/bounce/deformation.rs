//! Surfels of skinned and morphed meshes, which follow the triangles that they lie on.

use super::mesh_surfels::{MeshSurfel, area_vector};
use crate::shadows::casters::Caster;
use bevy::{
    mesh::{Mesh, VertexAttributeValues, morph::MorphAttributes},
    prelude::*,
};

/// The vertices of a mesh in the pose of a caster.
pub(super) struct Deformation<'a> {
    caster: &'a Caster,
    positions: &'a [[f32; 3]],
    joints: &'a [[u16; 4]],
    weights: &'a [[f32; 4]],
    targets: &'a [MorphAttributes],
}

impl<'a> Deformation<'a> {
    /// `None` for a rigid mesh.
    pub(super) fn of(caster: &'a Caster, mesh: &'a Mesh) -> Option<Self> {
        let Ok(VertexAttributeValues::Float32x3(positions)) = mesh.try_attribute(Mesh::ATTRIBUTE_POSITION) else {
            return None;
        };
        let joints = mesh.try_attribute(Mesh::ATTRIBUTE_JOINT_INDEX).ok();
        let weights = mesh.try_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT).ok();
        let (joints, weights) = match (joints, weights) {
            (Some(VertexAttributeValues::Uint16x4(joints)), Some(VertexAttributeValues::Float32x4(weights)))
                if !caster.joints.is_empty() =>
            {
                (&joints[..], &weights[..])
            }
            _ => (&[][..], &[][..]),
        };
        let targets = mesh.try_morph_targets().ok().filter(|_| !caster.morph_weights.is_empty());
        let targets = targets.map_or(&[][..], Vec::as_slice);
        let is_rigid = joints.is_empty() && targets.is_empty();
        (!is_rigid).then_some(Self { caster, positions, joints, weights, targets })
    }

    /// Position of a vertex in the world.
    fn vertex(&self, vertex: usize) -> Vec3 {
        let offset = |(weight, target): (&f32, &[MorphAttributes])| *weight * target[vertex].position;
        let targets = self.targets.chunks_exact(self.positions.len());
        let morphed: Vec3 = self.caster.morph_weights.iter().zip(targets).map(offset).sum();
        let position = Vec3::from_array(self.positions[vertex]) + morphed;
        let (Some(joints), Some(weights)) = (self.joints.get(vertex), self.weights.get(vertex)) else {
            return self.caster.world_from_local.transform_point3(position);
        };
        let matrix = |joint: u16| self.caster.joints.get(usize::from(joint)).copied().unwrap_or(Mat4::ZERO);
        let blended: Mat4 = joints.iter().zip(weights).map(|(joint, weight)| matrix(*joint) * *weight).sum();
        blended.transform_point3(position)
    }

    /// Position and normal × area of a surfel in the world.
    pub(super) fn place(&self, surfel: &MeshSurfel) -> (Vec3, Vec3) {
        let at_rest = area_vector(surfel.corners.map(|corner| Vec3::from_array(self.positions[corner]))).length();
        let corners = surfel.corners.map(|corner| self.vertex(corner));
        let position = Mat3::from_cols(corners[0], corners[1], corners[2]) * surfel.barycentric;
        (position, area_vector(corners) * (surfel.area_vector.length() / at_rest.max(f32::MIN_POSITIVE)))
    }
}
