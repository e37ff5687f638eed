//! Meshes for outlines: hard edges split the normals of a mesh, and a hull blown up along split normals tears there.

use bevy::{
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues},
    platform::collections::HashMap,
    prelude::*,
};

/// Normals that differ by less than this cosine are the same; 2.6°, invisible in an outline.
const SAME_NORMAL: f32 = 0.999;

/// The hull of each outlined mesh, where it differs from the mesh itself.
#[derive(Resource, Default)]
pub(super) struct Hulls {
    by_mesh: HashMap<AssetId<Mesh>, Option<Handle<Mesh>>>,
}

impl Hulls {
    /// The mesh to draw around a mesh: the mesh itself where its normals will do or its data is on the GPU only.
    pub(super) fn around(&mut self, mesh: &Handle<Mesh>, meshes: &mut Assets<Mesh>) -> Handle<Mesh> {
        if !self.by_mesh.contains_key(&mesh.id()) {
            let Some(source) = meshes.get(mesh) else {
                return mesh.clone();
            };
            let hull = with_merged_normals(source).map(|hull| meshes.add(hull));
            self.by_mesh.insert(mesh.id(), hull);
        }
        self.by_mesh.get(&mesh.id()).cloned().flatten().unwrap_or_else(|| mesh.clone())
    }
}

pub(super) fn forget_changed_hulls(mut changes: MessageReader<AssetEvent<Mesh>>, mut hulls: ResMut<Hulls>) {
    for change in changes.read() {
        if let AssetEvent::Modified { id } | AssetEvent::Removed { id } = change {
            hulls.by_mesh.remove(id);
        }
    }
}

/// A copy in which all vertices at one place have one normal, the mean of the faces there weighted by their angles.
/// `None` if that changes nothing, or cannot be done.
fn with_merged_normals(mesh: &Mesh) -> Option<Mesh> {
    let Ok(VertexAttributeValues::Float32x3(positions)) = mesh.try_attribute(Mesh::ATTRIBUTE_POSITION) else {
        return None;
    };
    if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
        return None;
    }
    // Adding zero turns −0 into 0, which is the same place.
    let place = |position: &[f32; 3]| position.map(|v| (v + 0.0).to_bits());
    let mut sums: HashMap<[u32; 3], Vec3> = HashMap::default();
    let corners: Vec<usize> = match mesh.try_indices_option().ok()? {
        Some(indices) => Indices::iter(indices).collect(),
        None => (0..positions.len()).collect(),
    };
    for triangle in corners.chunks_exact(3) {
        for k in 0..3 {
            let corner = |j: usize| triangle.get((k + j) % 3).and_then(|i| positions.get(*i));
            let (Some(at), Some(next), Some(last)) = (corner(0), corner(1), corner(2)) else {
                continue;
            };
            let (to_next, to_last) = (Vec3::from(*next) - Vec3::from(*at), Vec3::from(*last) - Vec3::from(*at));
            let across = to_next.cross(to_last);
            let angle = across.length().atan2(to_next.dot(to_last));
            *sums.entry(place(at)).or_default() += angle * across.normalize_or_zero();
        }
    }
    let merged: Vec<Vec3> =
        positions.iter().map(|p| sums.get(&place(p)).copied().unwrap_or_default().normalize_or_zero()).collect();
    if let Ok(VertexAttributeValues::Float32x3(normals)) = mesh.try_attribute(Mesh::ATTRIBUTE_NORMAL)
        && normals.iter().zip(&merged).all(|(normal, merged)| Vec3::from(*normal).dot(*merged) > SAME_NORMAL)
    {
        return None;
    }
    let merged: Vec<[f32; 3]> = merged.iter().map(Vec3::to_array).collect();
    let mut hull = mesh.clone();
    hull.try_insert_attribute(Mesh::ATTRIBUTE_NORMAL, merged).ok()?;
    Some(hull)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_a_cube_point_along_its_diagonals() {
        let cube = Cuboid::default().mesh().build();
        let hull = with_merged_normals(&cube).expect("a cube has hard edges");
        let values = |mesh: &Mesh, attribute| match mesh.try_attribute(attribute) {
            Ok(VertexAttributeValues::Float32x3(values)) => values.iter().copied().map(Vec3::from).collect::<Vec<_>>(),
            other => panic!("{other:?}"),
        };
        let positions = values(&cube, Mesh::ATTRIBUTE_POSITION);
        for (normal, corner) in values(&hull, Mesh::ATTRIBUTE_NORMAL).iter().zip(&positions) {
            assert!(normal.dot(corner.normalize()) > 0.9999, "{normal} at {corner}");
        }
    }

    #[test]
    fn a_smooth_mesh_is_its_own_hull() {
        let ball = Sphere::new(1.0).mesh().uv(24, 16);
        assert!(with_merged_normals(&ball).is_none());
    }

    #[test]
    fn odd_meshes_have_no_hull_of_their_own() {
        let mut broken = Cuboid::default().mesh().build();
        broken.insert_indices(Indices::U32(vec![0, 1, 99, 7]));
        let empty = Mesh::new(PrimitiveTopology::TriangleList, default());
        let lines = Mesh::new(PrimitiveTopology::LineList, default());
        for mesh in [broken, empty, lines] {
            assert!(with_merged_normals(&mesh).is_none_or(|hull| hull.count_vertices() == mesh.count_vertices()));
        }
    }
}
