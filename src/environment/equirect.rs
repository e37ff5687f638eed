//! Environment cubes as equirectangular pictures.
//!
//! Layout: column u/width is the azimuth from −Z towards +X, row v/height runs from +Y down to −Y, pixel centers at halves;
//! linear radiance, three channels.

use bevy::prelude::*;
use std::f32::consts::{PI, TAU};

/// A cube map on the CPU, in Bevy's convention: layers +X, −X, +Y, −Y, +Z, −Z of a left-handed frame whose z is the
/// negative of the world's.
#[derive(Clone, Debug, PartialEq)]
pub struct CubePixels {
    /// Edge length in texels.
    pub edge: u32,
    /// `6 · edge²` texels, layer by layer, rows from top to bottom; linear red, green, blue.
    pub texels: Vec<Vec3>,
}

impl CubePixels {
    /// Reads the bytes of an `Rgba16Float` cube texture's first mip level. `None` if there are not `48 · edge²` of them.
    pub fn from_rgba16f(edge: u32, bytes: &[u8]) -> Option<Self> {
        (bytes.len() == 48 * (edge as usize).pow(2) && edge > 0).then(|| {
            let channel = |texel: &[u8], i: usize| half::f16::from_le_bytes([texel[2 * i], texel[2 * i + 1]]).to_f32();
            let texels = bytes.chunks_exact(8).map(|t| Vec3::new(channel(t, 0), channel(t, 1), channel(t, 2)));
            Self { edge, texels: texels.collect() }
        })
    }

    /// Radiance arriving from a world direction, bilinear within a face.
    pub fn sample(&self, dir_world: Vec3) -> Vec3 {
        let dir = dir_world * Vec3::new(1.0, 1.0, -1.0);
        let size = dir.abs();
        let (face, p) = if size.x >= size.y && size.x >= size.z {
            if dir.x > 0.0 { (0, Vec2::new(-dir.z, -dir.y) / size.x) } else { (1, Vec2::new(dir.z, -dir.y) / size.x) }
        } else if size.y >= size.z {
            if dir.y > 0.0 { (2, Vec2::new(dir.x, dir.z) / size.y) } else { (3, Vec2::new(dir.x, -dir.z) / size.y) }
        } else if dir.z > 0.0 {
            (4, Vec2::new(dir.x, -dir.y) / size.z)
        } else {
            (5, Vec2::new(-dir.x, -dir.y) / size.z)
        };
        let texel = (p * 0.5 + 0.5) * self.edge as f32 - 0.5;
        let corner = texel.floor();
        let t = texel - corner;
        let last = self.edge as i32 - 1;
        let fetch = |dx: i32, dy: i32| {
            let x = (corner.x as i32 + dx).clamp(0, last) as usize;
            let y = (corner.y as i32 + dy).clamp(0, last) as usize;
            self.texels[(face * self.edge as usize + y) * self.edge as usize + x]
        };
        fetch(0, 0).lerp(fetch(1, 0), t.x).lerp(fetch(0, 1).lerp(fetch(1, 1), t.x), t.y)
    }

    /// The cube as `width × width/2` equirectangular pixels, rows from top to bottom, in a frame turned against the world.
    pub fn to_equirect(&self, width: u32, world_from_picture: Quat) -> Vec<Vec3> {
        let height = width / 2;
        (0..width * height)
            .map(|i| {
                let (column, row) = (i % width, i / width);
                let uv = Vec2::new((column as f32 + 0.5) / width as f32, (row as f32 + 0.5) / height as f32);
                self.sample(world_from_picture * equirect_direction(uv))
            })
            .collect()
    }
}

/// Unit direction of a position in an equirectangular picture, 0…1 across and down.
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
    fn each_layer_is_found_in_its_world_direction() {
        let texels = (0..6).flat_map(|face| vec![Vec3::splat(face as f32); 16]).collect();
        let cube = CubePixels { edge: 4, texels };
        let layers = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::NEG_Z, Vec3::Z];
        for (layer, dir) in layers.into_iter().enumerate() {
            assert_eq!(cube.sample(dir).x, layer as f32);
        }
    }

    #[test]
    fn half_floats_are_read_in_order() {
        let bytes: Vec<u8> = (0..6u16)
            .flat_map(|i| {
                [half::f16::from_f32(f32::from(i)), half::f16::ONE, half::f16::ZERO, half::f16::ONE]
                    .into_iter()
                    .flat_map(half::f16::to_le_bytes)
                    .collect::<Vec<_>>()
            })
            .collect();
        let cube = CubePixels::from_rgba16f(1, &bytes).expect("48 bytes");
        assert_eq!(cube.texels[5], Vec3::new(5.0, 1.0, 0.0));
        assert!(CubePixels::from_rgba16f(2, &bytes).is_none());
    }
}
