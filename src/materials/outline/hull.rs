//! Hulls of meshes for outlines. Hard edges split the normals of a mesh, and a hull enlarged along split normals
//! tears there; so hulls have merged normals.

use bevy::{
    mesh::{Indices, MeshVertexAttribute, PrimitiveTopology, VertexAttributeValues},
    platform::collections::HashMap,
    prelude::*,
};

/// Smallest cosine between normals that count as the same: 2.6°, invisible in an outline.
const MIN_SAME_NORMAL_COSINE: f32 = 0.999;
/// Grid on which positions count as the same, as a fraction of the mesh's size: larger than rounding errors along
/// seams.
const POSITION_TOLERANCE: f32 = 1e-5;

/// Hull of each outlined mesh, or `None` where the mesh is its own hull.
#[derive(Resource, Default)]
pub(in crate::materials) struct Hulls {
    by_mesh: HashMap<AssetId<Mesh>, Option<Handle<Mesh>>>,
}

impl Hulls {
    /// Returns the hull of a mesh: the mesh itself if its normals need no merging or its data is on the GPU only.
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

/// Forgets the hulls of changed and removed meshes.
pub(in crate::materials) fn forget_changed_hulls(
    mut changes: MessageReader<AssetEvent<Mesh>>,
    mut hulls: ResMut<Hulls>,
) {
    for change in changes.read() {
        if let AssetEvent::Modified { id } | AssetEvent::Removed { id } = change {
            hulls.by_mesh.remove(id);
        }
    }
}

/// Merged data of all vertices at one position of a mesh.
#[derive(Default)]
struct MergedVertex {
    /// Sum of the normals of adjacent faces, weighted by their angles.
    across_faces: Vec3,
    /// Normal of the first vertex.
    normal: Option<Vec3>,
    /// Whether the vertices have different normals.
    is_split: bool,
}

/// Returns a copy of a mesh in which all vertices at one position have the same normal: where normals differ, the
/// mean of the adjacent faces' normals, weighted by their angles. Returns `None` if no normals differ or the mesh is
/// not a triangle list with positions and normals on the CPU.
fn with_merged_normals(mesh: &Mesh) -> Option<Mesh> {
    let positions = vectors(mesh, Mesh::ATTRIBUTE_POSITION)?;
    let normals = vectors(mesh, Mesh::ATTRIBUTE_NORMAL)?;
    if mesh.primitive_topology() != PrimitiveTopology::TriangleList || normals.len() != positions.len() {
        return None;
    }
    let size = positions.iter().map(|position| position.abs().max_element()).fold(f32::MIN_POSITIVE, f32::max);
    let key = |position: Vec3| (position / (POSITION_TOLERANCE * size)).round().as_ivec3();
    let mut places: HashMap<IVec3, MergedVertex> = HashMap::default();
    for (position, normal) in positions.iter().zip(&normals) {
        let place = places.entry(key(*position)).or_default();
        place.is_split |= normal.dot(*place.normal.get_or_insert(*normal)) < MIN_SAME_NORMAL_COSINE;
    }
    if !places.values().any(|place| place.is_split) {
        return None;
    }
    let corners: Vec<usize> = match mesh.try_indices_option().ok()? {
        Some(indices) => Indices::iter(indices).collect(),
        None => (0..positions.len()).collect(),
    };
    for triangle in corners.chunks_exact(3) {
        for k in 0..3 {
            let corner = |j: usize| triangle.get((k + j) % 3).and_then(|i| positions.get(*i)).copied();
            let (Some(at), Some(next), Some(last)) = (corner(0), corner(1), corner(2)) else {
                continue;
            };
            let across = (next - at).cross(last - at);
            let angle = across.length().atan2((next - at).dot(last - at));
            places.entry(key(at)).or_default().across_faces += angle * across.normalize_or_zero();
        }
    }
    let merged = positions.iter().zip(normals).map(|(position, normal)| match places.get(&key(*position)) {
        Some(MergedVertex { is_split: true, across_faces, .. }) => across_faces.normalize_or(normal).to_array(),
        _ => normal.to_array(),
    });
    let merged: Vec<[f32; 3]> = merged.collect();
    let mut hull = mesh.clone();
    hull.try_insert_attribute(Mesh::ATTRIBUTE_NORMAL, merged).ok()?;
    Some(hull)
}

fn vectors(mesh: &Mesh, attribute: MeshVertexAttribute) -> Option<Vec<Vec3>> {
    match mesh.try_attribute(attribute) {
        Ok(VertexAttributeValues::Float32x3(values)) => Some(values.iter().copied().map(Vec3::from).collect()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corners_of_a_cube_point_along_its_diagonals() {
        let cube = Cuboid::default().mesh().build();
        let hull = with_merged_normals(&cube).expect("a cube has hard edges");
        let values = |mesh, attribute| vectors(mesh, attribute).expect("three numbers each");
        let corners = values(&cube, Mesh::ATTRIBUTE_POSITION);
        for (normal, corner) in values(&hull, Mesh::ATTRIBUTE_NORMAL).iter().zip(&corners) {
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
