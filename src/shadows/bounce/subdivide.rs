//! Surfels of large surfaces, which are the smaller the nearer they are to an object: a virtual thing changes the light
//! of the desk around it, and hardly that of the rest.

use super::mesh_surfels::area_vector;
use crate::shadows::bounding_sphere::BoundingSphere;
use glam::Vec3;

/// Longest edge of a triangle, as a fraction of its distance from the center of the nearest object, or of that
/// object's radius where it is nearer.
const DETAIL: f32 = 0.35;
/// Factor on the former when there are too many triangles.
const COARSER: f32 = 1.3;

/// Divides triangles until they are small enough for the objects near them, or until there are as many as wanted.
pub(super) fn subdivide(triangles: &[[Vec3; 3]], objects: &[BoundingSphere], max_count: usize) -> Vec<[Vec3; 3]> {
    if objects.is_empty() || triangles.len() > max_count {
        return vec![];
    }
    let faces_objects = |triangle: &&[Vec3; 3]| {
        let normal = area_vector(**triangle).normalize_or_zero();
        objects.iter().any(|object| normal.dot(object.center - triangle[0]) > -object.radius)
    };
    let mut detail = DETAIL;
    loop {
        let mut found = Vec::with_capacity(max_count);
        let is_enough = triangles
            .iter()
            .filter(faces_objects)
            .all(|triangle| divide(*triangle, objects, detail, max_count, &mut found));
        if is_enough {
            return found;
        }
        detail *= COARSER;
    }
}

/// Returns whether the limit was kept.
fn divide(
    triangle: [Vec3; 3],
    objects: &[BoundingSphere],
    detail: f32,
    max_count: usize,
    found: &mut Vec<[Vec3; 3]>,
) -> bool {
    let [a, b, c] = triangle;
    let center = (a + b + c) / 3.0;
    let reach = |object: &BoundingSphere| center.distance(object.center).max(object.radius);
    let reach = objects.iter().map(reach).fold(f32::MAX, f32::min);
    let edges = [a.distance_squared(b), b.distance_squared(c), c.distance_squared(a)];
    let longest = edges.iter().copied().fold(0.0, f32::max);
    if longest.sqrt() > detail * reach {
        // Halves at the middle of the longest edge.
        let [a, b, c] = match edges.iter().position(|edge| *edge == longest) {
            Some(0) => [a, b, c],
            Some(1) => [b, c, a],
            _ => [c, a, b],
        };
        let middle = 0.5 * (a + b);
        return divide([a, middle, c], objects, detail, max_count, found)
            && divide([middle, b, c], objects, detail, max_count, found);
    }
    if area_vector(triangle).length_squared() > 0.0 {
        found.push(triangle);
    }
    found.len() <= max_count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_desk_is_finest_around_objects() {
        let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
        let desk = [
            [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, -1.0)],
            [corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, 1.0)],
        ];
        let object = BoundingSphere { center: Vec3::new(0.2, 0.05, 0.1), radius: 0.05 };
        for max_count in [150, 600] {
            let surfels = subdivide(&desk, &[object], max_count);
            assert!(surfels.len() <= max_count && surfels.len() > max_count / 4, "{}", surfels.len());
            let sum: Vec3 = surfels.iter().map(|triangle| area_vector(*triangle)).sum();
            assert!(sum.distance(4.0 * Vec3::Y) < 1e-3, "{sum}");
            let area = |near: bool| {
                let areas = surfels
                    .iter()
                    .filter(|t| (t[0].distance(object.center) < 0.1) == near)
                    .map(|t| area_vector(*t).length());
                areas.fold(0.0, f32::max)
            };
            assert!(30.0 * area(true) < area(false), "{} {}", area(true), area(false));
        }
        assert!(subdivide(&desk, &[], 100).is_empty());
    }
}
