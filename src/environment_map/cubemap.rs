//! Faces of cube maps, and cells of directions, on the CPU. Twin of `cubemap.wgsl`.

use bevy::{
    camera::primitives::{CUBE_MAP_FACES, CubeMapFace},
    prelude::*,
};

/// Unit world direction of a position on a layer of a cube map, −1…1 across and down. Twin of `face_direction` in
/// `cubemap.wgsl`, which stays in the cube's frame.
pub(super) fn face_direction(face: u32, p: Vec2) -> Vec3 {
    let CubeMapFace { target, up } = CUBE_MAP_FACES[face as usize];
    (target + target.cross(up) * p.x - up * p.y).normalize()
}

/// Layer of a cube map that a world direction meets, and the position on it, −1…1 across and down.
///
/// Twin of `place_of` in `cubemap.wgsl`, which expects the cube's frame. On an edge between faces, this one prefers
/// x, then y; the shader prefers z, then y.
pub(super) fn face_position(dir_world: Vec3) -> (usize, Vec2) {
    let size = dir_world.abs();
    let (face, length) = if size.x >= size.y && size.x >= size.z {
        (if dir_world.x > 0.0 { 0 } else { 1 }, size.x)
    } else if size.y >= size.z {
        (if dir_world.y > 0.0 { 2 } else { 3 }, size.y)
    } else {
        (if dir_world.z < 0.0 { 4 } else { 5 }, size.z)
    };
    let CubeMapFace { target, up } = CUBE_MAP_FACES[face];
    (face, Vec2::new(target.cross(up).dot(dir_world), -up.dot(dir_world)) / length)
}

/// Centers (unit vectors) and solid angles (steradians) of the cells of a cube with `edge` cells along an edge.
///
/// The order is not that of a cube map's texels: faces +X, −X, +Y, −Y, +Z, −Z in world axes; on each face rows, along
/// the last of the two other axes; in each row columns, along the first.
pub(crate) fn cube_directions(edge: u32) -> impl Iterator<Item = (Vec3, f32)> {
    let cell = 2.0 / edge as f32;
    (0..6 * edge * edge).map(move |i| {
        let (face, row, column) = (i / (edge * edge), i / edge % edge, i % edge);
        let (a, b) = ((column as f32 + 0.5) * cell - 1.0, (row as f32 + 0.5) * cell - 1.0);
        let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
        let pos = match face / 2 {
            0 => Vec3::new(sign, a, b),
            1 => Vec3::new(a, sign, b),
            _ => Vec3::new(a, b, sign),
        };
        let length = pos.length();
        (pos / length, cell * cell / (length * length * length))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// World ↔ frame of a cube.
    const MIRRORED_Z: Vec3 = Vec3::new(1.0, 1.0, -1.0);

    #[test]
    fn the_cells_cover_the_sphere() {
        let total: f32 = cube_directions(64).map(|(_, solid_angle)| solid_angle).sum();
        assert!((total - 4.0 * std::f32::consts::PI).abs() < 5e-3, "{total}");
        let mean: Vec3 = cube_directions(64).map(|(dir, solid_angle)| dir * solid_angle).sum();
        assert!(mean.length() < 1e-3);
    }

    #[test]
    fn faces_lie_as_graphics_apis_look_them_up() {
        // s_c and t_c for each major axis (Vulkan 1.3, 16.5.4 "Cube Map Face Selection").
        let table: [fn(Vec3) -> [f32; 2]; 6] =
            [|r| [-r.z, -r.y], |r| [r.z, -r.y], |r| [r.x, r.z], |r| [r.x, -r.z], |r| [r.x, -r.y], |r| [-r.x, -r.y]];
        for (dir, _) in cube_directions(8) {
            let (face, position) = face_position(dir);
            let r = dir * MIRRORED_Z;
            assert_eq!(position, Vec2::from(table[face](r)) / r.abs().max_element(), "{dir}");
            assert_eq!(r[face / 2].abs(), r.abs().max_element(), "{dir}");
            assert_eq!(r[face / 2] < 0.0, face % 2 == 1, "{dir}");
        }
    }

    /// Checks that the shader contains some WGSL which is also Rust, and evaluates that.
    macro_rules! from_shader {
        ($($token:tt)*) => {{
            let without_spaces = |text: &str| text.split_whitespace().collect::<String>();
            let expected = without_spaces(stringify!($($token)*));
            let shader = without_spaces(include_str!("cubemap.wgsl"));
            assert!(shader.contains(&expected), "cubemap.wgsl without {expected}");
            $($token)*
        }};
    }

    fn select(otherwise: f32, value: f32, condition: bool) -> f32 {
        if condition { value } else { otherwise }
    }

    fn vec3f(x: f32, y: f32, z: f32) -> Vec3 {
        Vec3::new(x, y, z)
    }

    /// Twin of `face_vector` in `cubemap.wgsl`.
    fn face_vector(face: u32, p: Vec2) -> Vec3 {
        let sign = if face % 2 == 1 { -1.0 } else { 1.0 };
        let (is_x, is_y) = (face < 2, face & 2 == 2);
        from_shader! {
            vec3f(
                select(select(sign * p.x, p.x, is_y), sign, is_x),
                select(-p.y, sign, is_y),
                select(select(sign, sign * p.y, is_y), -sign * p.x, is_x),
            )
        }
    }

    /// Twin of `place_of` in `cubemap.wgsl`.
    fn place_of(dir: Vec3) -> (usize, Vec2) {
        let max = f32::max;
        let size = dir.abs();
        let is_z = from_shader! { size.z >= max(size.x, size.y) };
        let is_y = from_shader! { !is_z && size.y >= size.x };
        let is_x = from_shader! { !is_z && !is_y };
        let along = from_shader! { select(select(dir.x, dir.y, is_y), dir.z, is_z) };
        let sign = if along < 0.0 { -1.0 } else { 1.0 };
        let right = from_shader! { select(select(sign * dir.x, dir.x, is_y), -sign * dir.z, is_x) };
        let down = from_shader! { select(-dir.y, sign * dir.z, is_y) };
        let face = usize::from(is_y) * 2 + usize::from(is_z) * 4 + usize::from(along < 0.0);
        (face, Vec2::new(right, down) / along.abs())
    }

    #[test]
    fn shaders_have_the_same_faces() {
        for face in 0..6 {
            for p in [Vec2::ZERO, Vec2::new(0.9, 0.2), Vec2::new(-0.3, 0.6), Vec2::new(0.5, -0.8)] {
                let vector = face_vector(face, p);
                assert!(face_direction(face, p).distance(vector.normalize() * MIRRORED_Z) < 1e-6, "{face} {p}");
                assert_eq!(place_of(vector), (face as usize, p));
                assert_eq!(face_position(vector * MIRRORED_Z), (face as usize, p));
            }
        }
    }
}
