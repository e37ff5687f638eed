//! Blocks: 6 · 8² parts of the sphere, each of which counts as light from one direction.

use glam::Vec4;

/// Blocks along a cube edge, as in `convolve.wgsl`.
pub(super) const BLOCK_EDGE: u32 = 8;
/// Blocks of a cube face.
pub(super) const FACE_BLOCKS: usize = (BLOCK_EDGE * BLOCK_EDGE) as usize;
/// Size of `Block` in `convolve.wgsl`.
const BLOCK_BYTES: u32 = 32;
/// Size of the buffer that holds the blocks of all faces.
pub(super) const BLOCK_BUFFER_BYTES: u32 = 6 * BLOCK_EDGE * BLOCK_EDGE * BLOCK_BYTES;

/// Solid angles of the blocks of a cube face in steradians, row by row.
///
/// Each is a small difference of four angles, which a GPU need not compute that accurately.
pub(super) fn block_angles() -> [Vec4; FACE_BLOCKS / 4] {
    let at = |i: u32| 2.0 * f64::from(i) / f64::from(BLOCK_EDGE) - 1.0;
    // Antiderivative of the solid angle of a rectangle on the face plane z = 1 with a corner on the axis.
    let corner = |x: f64, y: f64| (x * y).atan2((x * x + y * y + 1.0).sqrt());
    std::array::from_fn(|i| {
        let angle = |k: u32| {
            let (column, row) = ((4 * i as u32 + k) % BLOCK_EDGE, (4 * i as u32 + k) / BLOCK_EDGE);
            let (left, right, top, bottom) = (at(column), at(column + 1), at(row), at(row + 1));
            (corner(right, bottom) + corner(left, top) - corner(left, bottom) - corner(right, top)) as f32
        };
        Vec4::new(angle(0), angle(1), angle(2), angle(3))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_blocks_of_a_face_cover_a_sixth_of_the_sphere() {
        let sum: f32 = block_angles().iter().map(|angles| angles.element_sum()).sum();
        assert!((sum - 4.0 * std::f32::consts::PI / 6.0).abs() < 1e-5, "{sum}");
    }
}
