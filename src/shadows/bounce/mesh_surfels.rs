//! Surfels of a mesh: its surface in patches of similar size, in the frame of the mesh.

use bevy::{
    mesh::{Mesh, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};

/// Points on the surface per surfel, from which surfels are formed.
const POINTS_PER_SURFEL: usize = 32;
/// Rounds of the k-means algorithm. Surfels hardly move after the first few.
const ROUNDS: usize = 6;
/// Distance, in edges of a surfel, that counts as much as two opposite normals: surfels do not reach around edges.
const NORMAL_DISTANCE: f32 = 3.0;

/// Patch of a mesh that counts as a small flat disc.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeshSurfel {
    /// Point on the surface.
    pub position: Vec3,
    /// Normal × area.
    pub area_vector: Vec3,
    /// Vertices of the triangle that the point lies on, and the weights with which they make up the point.
    pub corners: [usize; 3],
    pub barycentric: Vec3,
}

/// Triangles of a mesh, as the indices of their vertices.
struct Triangles<'a> {
    positions: &'a [[f32; 3]],
    corners: Vec<[usize; 3]>,
}

impl<'a> Triangles<'a> {
    /// `None` for meshes that are no triangle lists, or whose data is not on the CPU.
    fn of(mesh: &'a Mesh) -> Option<Self> {
        if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
            return None;
        }
        let Ok(VertexAttributeValues::Float32x3(positions)) = mesh.try_attribute(Mesh::ATTRIBUTE_POSITION) else {
            return None;
        };
        let indices: Vec<usize> = match mesh.try_indices() {
            Ok(indices) => indices.iter().collect(),
            Err(_) => (0..positions.len()).collect(),
        };
        let corners = indices
            .chunks_exact(3)
            .filter(|corners| corners.iter().all(|corner| *corner < positions.len()))
            .map(|corners| [corners[0], corners[1], corners[2]])
            .collect();
        Some(Self { positions, corners })
    }

    fn points(&self, triangle: usize) -> [Vec3; 3] {
        self.corners[triangle].map(|corner| Vec3::from_array(self.positions[corner]))
    }
}

/// Normal × area of a triangle.
pub(super) fn area_vector([a, b, c]: [Vec3; 3]) -> Vec3 {
    0.5 * (b - a).cross(c - a)
}

/// A point on the surface.
#[derive(Clone, Copy)]
struct SurfacePoint {
    position: Vec3,
    normal: Vec3,
    triangle: usize,
    barycentric: Vec3,
}

/// Spreads points evenly over a surface: equal areas along the list of triangles, a low-discrepancy sequence within
/// them (Roberts 2018, *The Unreasonable Effectiveness of Quasirandom Sequences*).
fn spread_points(triangles: &Triangles, count: usize) -> (Vec<SurfacePoint>, f32) {
    let areas: Vec<f32> = (0..triangles.corners.len()).map(|i| area_vector(triangles.points(i)).length()).collect();
    let total: f32 = areas.iter().sum();
    let (mut triangle, mut passed) = (0, 0.0);
    let point = |i: usize| {
        let wanted = (i as f32 + 0.5) / count as f32 * total;
        while triangle + 1 < areas.len() && passed + areas[triangle] < wanted {
            passed += areas[triangle];
            triangle += 1;
        }
        let [a, b, c] = triangles.points(triangle);
        let (mut u, mut v) = ((0.754_877_7 * (i + 1) as f32).fract(), (0.569_840_3 * (i + 1) as f32).fract());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let normal = area_vector([a, b, c]).normalize_or_zero();
        let barycentric = Vec3::new(1.0 - u - v, u, v);
        SurfacePoint { position: Mat3::from_cols(a, b, c) * barycentric, normal, triangle, barycentric }
    };
    (if total > 0.0 && total.is_finite() { (0..count).map(point).collect() } else { vec![] }, total)
}

/// Divides the surface of a mesh into surfels by the k-means algorithm over positions and normals. Empty for meshes
/// that are no triangle lists, or whose data is not on the CPU.
pub(super) fn mesh_surfels(mesh: &Mesh, count: usize) -> Vec<MeshSurfel> {
    let Some(triangles) = Triangles::of(mesh) else {
        return vec![];
    };
    let (points, total) = spread_points(&triangles, count * POINTS_PER_SURFEL);
    if points.is_empty() {
        return vec![];
    }
    let turn = NORMAL_DISTANCE * NORMAL_DISTANCE * total / count as f32;
    let distance = |point: &SurfacePoint, center: &(Vec3, Vec3)| {
        point.position.distance_squared(center.0) + 0.25 * turn * point.normal.distance_squared(center.1)
    };
    let mut centers: Vec<(Vec3, Vec3)> =
        points.iter().skip(POINTS_PER_SURFEL / 2).step_by(POINTS_PER_SURFEL).map(|p| (p.position, p.normal)).collect();
    let mut members = vec![0; points.len()];
    for _ in 0..ROUNDS {
        for (member, point) in members.iter_mut().zip(&points) {
            *member = nearest(&centers, |center| distance(point, center));
        }
        let mut sums = vec![(Vec3::ZERO, Vec3::ZERO, 0.0); centers.len()];
        for (member, point) in members.iter().zip(&points) {
            let sum = &mut sums[*member];
            *sum = (sum.0 + point.position, sum.1 + point.normal, sum.2 + 1.0);
        }
        for (center, (position, normal, number)) in centers.iter_mut().zip(&sums) {
            if *number > 0.0 {
                *center = (*position / *number, *normal / *number);
            }
        }
    }
    let area = total / points.len() as f32;
    let surfel = |(index, center): (usize, &(Vec3, Vec3))| {
        let own = || points.iter().zip(&members).filter(|(_, member)| **member == index).map(|(point, _)| point);
        let on_surface = own().min_by(|a, b| distance(a, center).total_cmp(&distance(b, center)))?;
        let area_vector = area * own().map(|point| point.normal).sum::<Vec3>();
        Some(MeshSurfel {
            position: on_surface.position,
            area_vector,
            corners: triangles.corners[on_surface.triangle],
            barycentric: on_surface.barycentric,
        })
    };
    centers.iter().enumerate().filter_map(surfel).filter(|surfel| surfel.area_vector.length() > 0.0).collect()
}

/// Index of the item with the smallest value.
fn nearest<T>(items: &[T], value: impl Fn(&T) -> f32) -> usize {
    items.iter().enumerate().map(|(i, item)| (i, value(item))).min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    #[test]
    fn surfels_cover_a_ball_evenly() {
        let surfels = mesh_surfels(&Sphere::new(0.5).mesh().uv(48, 24), 64);
        assert!((60..=64).contains(&surfels.len()), "{}", surfels.len());
        let area: f32 = surfels.iter().map(|surfel| surfel.area_vector.length()).sum();
        // A flat disc is smaller than the cap that it stands for.
        assert!((0.9 * PI..=PI).contains(&area), "{area}");
        let closed: Vec3 = surfels.iter().map(|surfel| surfel.area_vector).sum();
        assert!(closed.length() < 0.02 * PI, "{closed}");
        for surfel in &surfels {
            let (outwards, normal) = (surfel.position.normalize(), surfel.area_vector.normalize());
            assert!(outwards.dot(normal) > 0.95 && (surfel.position.length() - 0.5).abs() < 0.02);
            assert!((0.3..2.0).contains(&(surfel.area_vector.length() * 64.0 / PI)), "{}", surfel.area_vector.length());
        }
    }

    #[test]
    fn surfels_of_a_box_do_not_reach_around_its_edges() {
        let surfels = mesh_surfels(&Cuboid::new(1.0, 2.0, 3.0).mesh().build(), 48);
        for surfel in &surfels {
            assert!(surfel.area_vector.normalize().abs().max_element() > 0.999, "{}", surfel.area_vector);
        }
        let area: f32 = surfels.iter().map(|surfel| surfel.area_vector.length()).sum();
        assert!((area - 22.0).abs() < 0.01, "{area}");
    }

    #[test]
    fn meshes_without_triangles_have_no_surfels() {
        let line = Polyline3d::new([Vec3::ZERO, Vec3::X]).mesh().build();
        assert!(mesh_surfels(&line, 16).is_empty());
        let point = Triangle3d::new(Vec3::X, Vec3::X, Vec3::X).mesh().build();
        assert!(mesh_surfels(&point, 16).is_empty());
    }
}
