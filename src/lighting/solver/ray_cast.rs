//! Ray casting against phantoms (triangles) and balls (spheres).

use bevy::{
    math::Affine3A,
    mesh::{Mesh, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};

/// A real object on the desk, in world space.
#[derive(Clone, Debug, PartialEq)]
pub struct PhantomSolid {
    /// Whether it casts shadows. Supporting planes do not.
    pub casts: bool,
    /// Whether its brightness reveals the light on it. That of mirrors does not.
    pub receives: bool,
    /// Fraction of light that it reflects, per channel, if known.
    pub reflectance: Option<Vec3>,
    triangles: Vec<[Vec3; 3]>,
    center: Vec3,
    radius: f32,
    /// Corners of the bounding box.
    bounds: [Vec3; 2],
}

/// Distance of ray origins from their surface, meters. Meshes are not more exact than that.
pub(super) const SURFACE_OFFSET: f32 = 5e-4;

/// Margin of bounding boxes, meters. Gives flat solids a volume.
const BOUNDS_MARGIN: f32 = 1e-5;

impl PhantomSolid {
    /// Creates a solid from the triangles of a mesh; `None` if it has none that the CPU can read.
    pub fn from_mesh(mesh: &Mesh, world_from_mesh: &Affine3A) -> Option<Self> {
        if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
            return None;
        }
        let Some(VertexAttributeValues::Float32x3(positions)) = mesh.try_attribute(Mesh::ATTRIBUTE_POSITION).ok()
        else {
            return None;
        };
        let vertices: Vec<Vec3> =
            positions.iter().map(|p| world_from_mesh.transform_point3(Vec3::from_array(*p))).collect();
        let corners: Vec<usize> = match mesh.try_indices().ok() {
            Some(indices) => indices.iter().collect(),
            None => (0..vertices.len()).collect(),
        };
        let triangles = corners
            .chunks_exact(3)
            .filter_map(|t| Some([*vertices.get(t[0])?, *vertices.get(t[1])?, *vertices.get(t[2])?]))
            .collect();
        Self::from_triangles(triangles)
    }

    /// Creates a solid from triangles in world space; `None` if there are none or they are not finite.
    pub fn from_triangles(triangles: Vec<[Vec3; 3]>) -> Option<Self> {
        let (low, high) = triangles
            .iter()
            .flatten()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        if !(low.is_finite() && high.is_finite()) {
            return None;
        }
        let center = 0.5 * (low + high);
        let radius = triangles.iter().flatten().map(|p| p.distance(center)).fold(0.0, f32::max);
        Some(Self {
            casts: true,
            receives: true,
            reflectance: None,
            triangles,
            center,
            radius,
            bounds: [low - BOUNDS_MARGIN, high + BOUNDS_MARGIN],
        })
    }

    /// The triangles in world space.
    pub(super) fn triangles(&self) -> &[[Vec3; 3]] {
        &self.triangles
    }

    /// Whether every corner lies within a sphere. Identifies stand-ins for the ball itself.
    pub fn is_within(&self, center: Vec3, radius: f32) -> bool {
        self.triangles.iter().flatten().all(|p| p.distance(center) <= radius)
    }

    /// Distance along a ray to the nearest triangle and the normal of that triangle, on the side of the ray's origin.
    pub(super) fn hit(&self, origin: Vec3, dir: Vec3) -> Option<(f32, Vec3)> {
        if !self.is_near(origin, dir) {
            return None;
        }
        let mut nearest: Option<(f32, &[Vec3; 3])> = None;
        for triangle in &self.triangles {
            if let Some(distance) = triangle_distance(triangle, origin, dir)
                && nearest.is_none_or(|(best, _)| distance < best)
            {
                nearest = Some((distance, triangle));
            }
        }
        nearest.map(|(distance, [a, b, c])| {
            let normal = (*b - *a).cross(*c - *a).normalize_or_zero();
            (distance, if normal.dot(dir) > 0.0 { -normal } else { normal })
        })
    }

    /// Whether a ray hits any triangle. Consecutive rays mostly hit the same triangle: `guess` is its index.
    pub(super) fn is_hit(&self, origin: Vec3, dir: Vec3, guess: &mut usize) -> bool {
        if !self.is_near(origin, dir) {
            return false;
        }
        let is_hit = |triangle: &[Vec3; 3]| triangle_distance(triangle, origin, dir).is_some();
        if self.triangles.get(*guess).is_some_and(is_hit) {
            return true;
        }
        let found = self.triangles.iter().position(is_hit);
        *guess = found.unwrap_or(*guess);
        found.is_some()
    }

    /// Whether any part of the solid is above a plane.
    pub(super) fn is_above(&self, origin: Vec3, normal: Vec3) -> bool {
        (self.center - origin).dot(normal) > -self.radius
    }

    /// Whether a ray hits the bounding sphere and the bounding box (Kay & Kajiya 1986).
    fn is_near(&self, origin: Vec3, dir: Vec3) -> bool {
        if !sphere_is_hit(self.center - origin, self.radius, dir) {
            return false;
        }
        let (a, b) = ((self.bounds[0] - origin) / dir, (self.bounds[1] - origin) / dir);
        a.max(b).min_element() >= a.min(b).max_element().max(0.0)
    }
}

/// Distance along a ray to a two-sided triangle (Möller & Trumbore 1997).
fn triangle_distance([a, b, c]: &[Vec3; 3], origin: Vec3, dir: Vec3) -> Option<f32> {
    let (ab, ac) = (*b - *a, *c - *a);
    let p = dir.cross(ac);
    let det = ab.dot(p);
    if det.abs() < 1e-12 {
        return None;
    }
    let from_a = origin - *a;
    let u = from_a.dot(p) / det;
    if u.min(1.0 - u) < 0.0 {
        return None;
    }
    let q = from_a.cross(ab);
    let v = dir.dot(q) / det;
    if v < 0.0 || u + v > 1.0 {
        return None;
    }
    let distance = ac.dot(q) / det;
    (distance > 0.0).then_some(distance)
}

/// Whether a ray from the coordinate origin hits a sphere. `true` inside the sphere.
pub(super) fn sphere_is_hit(center: Vec3, radius: f32, dir: Vec3) -> bool {
    let along = center.dot(dir);
    let outside = center.length_squared() - radius * radius;
    outside <= 0.0 || (along > 0.0 && along * along >= outside)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_hit_from_outside_where_it_stands() {
        let mesh = Cuboid::new(0.2, 0.1, 0.2).mesh().build();
        let solid = PhantomSolid::from_mesh(&mesh, &Affine3A::from_translation(Vec3::Y)).expect("a box has triangles");
        let (distance, normal) = solid.hit(Vec3::new(0.05, 0.0, 0.02), Vec3::Y).expect("above");
        assert!((distance - 0.95).abs() < 1e-5 && normal.distance(Vec3::NEG_Y) < 1e-5, "{distance} {normal}");
        assert!(solid.hit(Vec3::new(0.15, 0.0, 0.0), Vec3::Y).is_none());
        assert!(solid.hit(Vec3::ZERO, Vec3::NEG_Y).is_none());
        assert!(solid.is_within(Vec3::Y, 0.2) && !solid.is_within(Vec3::ZERO, 0.2));
    }

    #[test]
    fn whether_a_ray_hits_does_not_depend_on_the_guess() {
        let mesh = Cylinder::new(0.04, 0.1).mesh().build();
        let solid = PhantomSolid::from_mesh(&mesh, &Affine3A::from_translation(Vec3::new(0.1, 0.05, 0.0)))
            .expect("a can has triangles");
        let origin = Vec3::new(0.0, 0.02, 0.03);
        let (mut guess, mut hits) = (0, 0);
        for i in 0..4000_i16 {
            let y = 1.0 - 2.0 * (f32::from(i) + 0.5) / 4000.0;
            let (sin, cos) = (f32::from(i) * 2.4).sin_cos();
            let across = (1.0 - y * y).sqrt();
            let dir = Vec3::new(across * cos, y, across * sin);
            let is_hit = solid.is_hit(origin, dir, &mut guess);
            assert_eq!(is_hit, solid.hit(origin, dir).is_some(), "{dir}");
            assert_eq!(is_hit, solid.triangles.iter().any(|t| triangle_distance(t, origin, dir).is_some()), "{dir}");
            hits += usize::from(is_hit);
        }
        assert!((100..1000).contains(&hits), "{hits}");
        assert!(solid.is_above(origin, Vec3::Y) && !solid.is_above(Vec3::Y, Vec3::Y));
    }
}
