//! Cube maps on the CPU: directions of their faces and cells. The shaders' part is `cubemap.wgsl`.

use bevy::prelude::*;

/// Centers (unit vectors) and solid angles (steradian) of the cells of a cube map with `edge` cells along an edge, in an
/// unspecified order.
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

/// Unit world direction of a position on a layer of a cube map, −1…1 across and down.
pub(crate) fn face_direction(face: u32, p: Vec2) -> Vec3 {
    let dir = match face {
        0 => Vec3::new(1.0, -p.y, -p.x),
        1 => Vec3::new(-1.0, -p.y, p.x),
        2 => Vec3::new(p.x, 1.0, p.y),
        3 => Vec3::new(p.x, -1.0, -p.y),
        4 => Vec3::new(p.x, -p.y, 1.0),
        _ => Vec3::new(-p.x, -p.y, -1.0),
    };
    dir.normalize() * Vec3::new(1.0, 1.0, -1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cells_cover_the_sphere() {
        let total: f32 = cube_directions(64).map(|(_, solid_angle)| solid_angle).sum();
        assert!((total - 4.0 * std::f32::consts::PI).abs() < 5e-3, "{total}");
        let mean: Vec3 = cube_directions(64).map(|(dir, solid_angle)| dir * solid_angle).sum();
        assert!(mean.length() < 1e-3);
    }
}
