//! Equirectangular images on the CPU, and their conversion from and to cube maps.

use super::{CubePixels, face_direction};
use crate::image_files::shrink;
use glam::{Quat, UVec2, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Equirectangular image on the CPU, twice as wide as high: column ÷ width is the azimuth from −Z towards +X, row ÷
/// height runs from +Y down to −Y. Pixel centers are at halves.
#[derive(Clone, Debug, PartialEq)]
pub struct EquirectPixels {
    /// Width and height in pixels.
    pub size: UVec2,
    /// Rows from top to bottom; linear red, green, blue.
    pub texels: Vec<Vec3>,
}

/// Maximum number of samples along each edge of a cube texel.
const MAX_SAMPLES: u32 = 16;

impl EquirectPixels {
    /// Radiance from a direction in the image's axes, interpolated bilinearly, also across the seam at azimuth 0.
    pub fn sample(&self, dir_image: Vec3) -> Vec3 {
        let size = self.size.as_ivec2();
        let pixel = equirect_position(dir_image) * self.size.as_vec2() - 0.5;
        let corner = pixel.floor();
        let t = pixel - corner;
        let fetch = |dx: i32, dy: i32| {
            let row = (corner.y as i32 + dy).clamp(0, size.y - 1);
            let column = (corner.x as i32 + dx).rem_euclid(size.x);
            self.texels[(row * size.x + column) as usize]
        };
        fetch(0, 0).lerp(fetch(1, 0), t.x).lerp(fetch(0, 1).lerp(fetch(1, 1), t.x), t.y)
    }

    /// Image of at most `max_width` pixels (at least 2) across, each the mean of the part of this image that it covers.
    /// Returns a smaller image unchanged.
    pub fn limited_to(self, max_width: u32) -> Self {
        if self.size.x <= max_width {
            return self;
        }
        let height = (max_width / 2).max(1);
        let size = UVec2::new(2 * height, height);
        let mut texels = Vec::with_capacity(size.element_product() as usize);
        let read = |x: u32, y: u32| self.texels[(y * self.size.x + x) as usize];
        shrink(self.size, size, read, |row| texels.extend_from_slice(row));
        Self { size, texels }
    }

    /// Cube map with `edge` texels along an edge, each the mean of the part of the image that it covers.
    pub fn to_cube(&self, edge: u32, world_from_image: Quat) -> CubePixels {
        let edge = edge.max(1);
        // A texel in the center of a face is 2 / edge wide, a pixel at the horizon 2π / width.
        let pixels_per_texel = self.size.x as f32 / (PI * edge as f32);
        let samples = (2.0 * pixels_per_texel).ceil().clamp(1.0, MAX_SAMPLES as f32) as u32;
        let image_from_world = world_from_image.inverse();
        let texels = (0..6 * edge * edge).map(|i| {
            let (face, corner) = (i / (edge * edge), UVec2::new(i % edge, i / edge % edge).as_vec2());
            let sum: Vec3 = (0..samples * samples)
                .map(|j| {
                    let offset = (UVec2::new(j % samples, j / samples).as_vec2() + 0.5) / samples as f32;
                    let p = 2.0 * (corner + offset) / edge as f32 - 1.0;
                    self.sample(image_from_world * face_direction(face, p))
                })
                .sum();
            sum / (samples * samples) as f32
        });
        CubePixels { edge, texels: texels.collect() }
    }
}

impl CubePixels {
    /// Equirectangular image with a width in pixels (even, at least 2), in axes that may be rotated against the world.
    pub fn to_equirect(&self, width: u32, world_from_image: Quat) -> EquirectPixels {
        let size = UVec2::new(width, width / 2).max(UVec2::new(2, 1));
        let texels = (0..size.x * size.y).map(|i| {
            let uv = (UVec2::new(i % size.x, i / size.x).as_vec2() + 0.5) / size.as_vec2();
            self.sample(world_from_image * equirect_direction(uv))
        });
        EquirectPixels { size, texels: texels.collect() }
    }
}

/// Position of a unit direction in an equirectangular image, 0…1 across and down.
pub fn equirect_position(dir: Vec3) -> Vec2 {
    Vec2::new((dir.x.atan2(-dir.z) / TAU).rem_euclid(1.0), dir.y.clamp(-1.0, 1.0).acos() / PI)
}

/// Unit direction of a position in an equirectangular image, 0…1 across and down.
pub fn equirect_direction(uv: Vec2) -> Vec3 {
    let (sin_azimuth, cos_azimuth) = (TAU * uv.x).sin_cos();
    let (sin_polar, cos_polar) = (PI * uv.y).sin_cos();
    Vec3::new(sin_polar * sin_azimuth, cos_polar, -sin_polar * cos_azimuth)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_run_from_minus_z_over_plus_x_and_rows_from_up_to_down() {
        let near = |uv: Vec2, dir: Vec3| assert!(equirect_direction(uv).distance(dir) < 1e-5, "{uv}");
        near(Vec2::new(0.0, 0.5), Vec3::NEG_Z);
        near(Vec2::new(0.25, 0.5), Vec3::X);
        near(Vec2::new(0.3, 0.0), Vec3::Y);
        near(Vec2::new(0.3, 1.0), Vec3::NEG_Y);
    }

    #[test]
    fn a_wide_image_is_averaged_to_what_a_device_can_hold() {
        let size = UVec2::new(16, 8);
        let image = EquirectPixels { size, texels: (0..128).map(|i| Vec3::splat((i % 16) as f32)).collect() };
        let small = image.clone().limited_to(9);
        assert_eq!((small.size, small.texels.len()), (UVec2::new(8, 4), 32));
        assert!(small.texels[..8].iter().enumerate().all(|(x, texel)| (texel.x - 2.0 * x as f32 - 0.5).abs() < 1e-4));
        assert_eq!(image.clone().limited_to(16), image);
    }

    #[test]
    fn positions_and_directions_are_inverse() {
        for (u, v) in [(0.01, 0.2), (0.26, 0.5), (0.5, 0.7), (0.99, 0.9)] {
            let uv = Vec2::new(u, v);
            assert!(equirect_position(equirect_direction(uv)).distance(uv) < 1e-5, "{uv}");
        }
    }

    /// Radiance that is linear in the direction. Bilinear interpolation reproduces it to second order.
    fn slope(dir: Vec3) -> Vec3 {
        Vec3::splat(2.0) + dir
    }

    #[test]
    fn an_image_becomes_a_cube_and_a_cube_the_same_image() {
        let size = UVec2::new(128, 64);
        let uv = |i: u32| (UVec2::new(i % size.x, i / size.x).as_vec2() + 0.5) / size.as_vec2();
        let texels = (0..size.x * size.y).map(|i| slope(equirect_direction(uv(i))));
        let image = EquirectPixels { size, texels: texels.collect() };
        let turn = Quat::from_rotation_y(0.7);
        let cube = image.to_cube(32, turn);
        for (dir, _) in crate::environment_map::cube_directions(8) {
            let (expected, found) = (slope(turn.inverse() * dir), cube.sample(dir));
            assert!(found.distance(expected) < 0.03, "{dir}: {found} instead of {expected}");
        }
        let again = cube.to_equirect(size.x, turn);
        assert_eq!(again.size, size);
        let worst = again.texels.iter().zip(&image.texels).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(worst < 0.08, "{worst}");
    }

    #[test]
    fn a_small_lamp_keeps_its_energy_in_a_coarse_cube() {
        let size = UVec2::new(512, 256);
        let mut image = EquirectPixels { size, texels: vec![Vec3::ZERO; (size.x * size.y) as usize] };
        let (column, row) = (200, 100);
        image.texels[(row * size.x + column) as usize] = Vec3::splat(1e4);
        let polar = PI * (row as f32 + 0.5) / size.y as f32;
        let expected = 1e4 * polar.sin() * (PI / size.y as f32) * (TAU / size.x as f32);
        let cube = image.to_cube(32, Quat::IDENTITY);
        let solid_angle = |i: usize| {
            let corner = UVec2::new(i as u32 % 32, i as u32 / 32 % 32).as_vec2();
            let p = (corner + 0.5) / 16.0 - 1.0;
            (1.0 / 16.0_f32).powi(2) / (1.0 + p.length_squared()).powf(1.5)
        };
        let energy: f32 = cube.texels.iter().enumerate().map(|(i, texel)| texel.x * solid_angle(i)).sum();
        assert!((energy / expected - 1.0).abs() < 0.1, "{energy} instead of {expected}");
    }
}
