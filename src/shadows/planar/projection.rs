//! The matrix that projects points onto a plane.

use bevy::prelude::*;

/// Matrix that projects homogeneous points onto a plane, away from a light (Blinn 1988, *Me and My (Fake) Shadow*).
///
/// `plane` is (n, d) of the plane n · x + d = 0. `light` is (position, 1) of a point light or (direction towards it, 0)
/// of a distant one. Of the projected point, w is above 0 where the shadow is: it is 0 or less for points that are no
/// nearer to the plane than a point light (whose mirrored images would be *anti-shadows*), if the light is on the side
/// to which n points. Points behind the plane are projected as well (*false shadows*), and have to be left out by
/// `plane · point < 0`.
///
/// ```
/// # use bevy::math::{Vec3, Vec4};
/// # use bevy_mirrorball::shadows::planar_projection;
/// // Straight down from a lamp 2 m above the floor, things at half of its height have shadows twice as large.
/// let onto_floor = planar_projection(Vec4::new(0.0, 1.0, 0.0, 0.0), Vec4::new(0.0, 2.0, 0.0, 1.0));
/// assert_eq!(onto_floor.project_point3(Vec3::new(0.3, 1.0, -0.1)), Vec3::new(0.6, 0.0, -0.2));
/// ```
pub fn planar_projection(plane: Vec4, light: Vec4) -> Mat4 {
    // (plane · light) I − light ⊗ plane
    let distance = plane.dot(light);
    let column = |axis: usize| {
        let mut column = -light * plane[axis];
        column[axis] += distance;
        column
    };
    Mat4::from_cols(column(0), column(1), column(2), column(3))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIGHT: Vec3 = Vec3::new(0.4, 1.7, -0.9);

    fn assert_rows(found: Mat4, rows: [[f32; 4]; 4]) {
        for (row, expected) in rows.into_iter().enumerate() {
            assert!(found.row(row).abs_diff_eq(expected.into(), 1e-6), "row {row}: {} {expected:?}", found.row(row));
        }
    }

    #[test]
    fn a_point_light_onto_the_planes_of_the_axes() {
        let Vec3 { x, y, z } = LIGHT;
        let onto = |normal: Vec3| planar_projection(normal.extend(0.0), LIGHT.extend(1.0));
        assert_rows(onto(Vec3::Z), [[z, 0., -x, 0.], [0., z, -y, 0.], [0.; 4], [0., 0., -1., z]]);
        assert_rows(onto(Vec3::Y), [[y, -x, 0., 0.], [0.; 4], [0., -z, y, 0.], [0., -1., 0., y]]);
        assert_rows(onto(Vec3::X), [[0.; 4], [-y, x, 0., 0.], [-z, 0., x, 0.], [-1., 0., 0., x]]);
    }

    #[test]
    fn parallel_light_along_an_axis() {
        let found = planar_projection(Vec4::Z, Vec4::Z);
        assert_rows(found, [[1., 0., 0., 0.], [0., 1., 0., 0.], [0.; 4], [0., 0., 0., 1.]]);
    }

    #[test]
    fn a_point_light_onto_any_plane() {
        let (n, d) = (Vec3::new(0.3, -0.8, 0.52).normalize(), 0.7);
        let found = planar_projection(n.extend(d), LIGHT.extend(1.0));
        let (along, l) = (n.dot(LIGHT), LIGHT);
        let row = |i: usize| {
            let mut row = [-l[i] * n.x, -l[i] * n.y, -l[i] * n.z, -l[i] * d];
            row[i] += along + d;
            row
        };
        assert_rows(found, [row(0), row(1), row(2), [-n.x, -n.y, -n.z, along]]);
    }

    #[test]
    fn shadows_lie_on_the_plane_in_line_with_the_light() {
        let plane = Vec3::new(0.2, 0.9, -0.3).normalize().extend(0.25);
        for light in [LIGHT.extend(1.0), LIGHT.extend(0.0)] {
            for place in [Vec3::new(0.1, 0.4, 0.2), Vec3::new(-0.6, 0.9, 0.0)] {
                let shadow = planar_projection(plane, light) * place.extend(1.0);
                let on_plane = shadow.truncate() / shadow.w;
                assert!(shadow.w > 0.0 && plane.dot(on_plane.extend(1.0)).abs() < 1e-6, "{shadow}");
                let from_light = light.truncate() - light.w * place;
                assert!(from_light.cross(on_plane - place).length() < 1e-5, "{light} {place}");
            }
        }
    }

    #[test]
    fn what_is_beyond_the_light_has_no_shadow() {
        let onto_floor = planar_projection(Vec4::Y, LIGHT.extend(1.0));
        assert!((onto_floor * Vec4::new(0.0, LIGHT.y + 0.1, 0.0, 1.0)).w < 0.0);
        assert!((onto_floor * Vec4::new(0.0, LIGHT.y - 0.1, 0.0, 1.0)).w > 0.0);
    }
}
