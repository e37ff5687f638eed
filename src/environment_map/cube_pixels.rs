//! Cube maps on the CPU.

use super::{cube_image, face_position};
use bevy::{prelude::*, render::render_resource::TextureUsages};

/// Cube map on the CPU, in Bevy's convention: layers +X, −X, +Y, −Y, +Z, −Z of a left-handed frame whose z is the
/// negative of the world's.
#[derive(Clone, Debug, PartialEq)]
pub struct CubePixels {
    /// Edge length in texels.
    pub edge: u32,
    /// `6 · edge²` texels, layer by layer, rows from top to bottom; linear red, green, blue.
    pub texels: Vec<Vec3>,
}

impl CubePixels {
    /// Reads the bytes of the first mip level of an `Rgba16Float` cube texture. `None` if their number is not `48 ·
    /// edge²`.
    pub fn from_rgba16f(edge: u32, bytes: &[u8]) -> Option<Self> {
        (bytes.len() == 48 * (edge as usize).pow(2) && edge > 0).then(|| {
            let channel = |texel: &[u8], i: usize| half::f16::from_le_bytes([texel[2 * i], texel[2 * i + 1]]).to_f32();
            let texels = bytes.chunks_exact(8).map(|t| Vec3::new(channel(t, 0), channel(t, 1), channel(t, 2)));
            Self { edge, texels: texels.collect() }
        })
    }

    /// Radiance from a world direction, interpolated bilinearly within a face.
    pub fn sample(&self, dir_world: Vec3) -> Vec3 {
        let (face, p) = face_position(dir_world);
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

    /// Cube texture of half floats, for [`LiveEnvironment`](crate::prefilter::LiveEnvironment), Bevy's `Skybox` or a
    /// material. Radiance is clamped to what half floats hold, 0 to 65504.
    pub fn to_image(&self) -> Image {
        let mut image = cube_image("mirrorball_environment", self.edge, 1);
        image.texture_descriptor.usage |= TextureUsages::COPY_DST;
        let channels =
            |texel: &Vec3| texel.clamp(Vec3::ZERO, Vec3::splat(half::f16::MAX.to_f32())).extend(1.0).to_array();
        let bytes = self.texels.iter().flat_map(channels).flat_map(|value| half::f16::from_f32(value).to_le_bytes());
        image.data = Some(bytes.collect());
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn a_cube_survives_the_way_through_a_texture() {
        let texels = (0..6 * 16).map(|i| Vec3::new(i as f32, 0.5, 1e6)).collect();
        let image = CubePixels { edge: 4, texels }.to_image();
        let back = CubePixels::from_rgba16f(4, image.data.as_deref().expect("on the CPU")).expect("as large");
        assert_eq!((back.texels[17], image.texture_descriptor.array_layer_count()), (Vec3::new(17.0, 0.5, 65504.0), 6));
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
