//! Sources of environments: which images are accepted.

use bevy::{
    prelude::*,
    render::render_resource::{TextureDimension, TextureFormat, TextureSampleType, TextureUsages},
};

/// Edge lengths of cubes that are filtered as they are. The least has at least one texel for each block of the sums.
const CUBE_EDGES: std::ops::RangeInclusive<u32> = 16..=8192;
/// Maximum edge length of a resampled cube; the sharpest specular level has 256.
const MAX_RESAMPLED_EDGE: u32 = 512;

/// Shape of a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SourceShape {
    /// Six square layers with this edge length.
    Cube(u32),
    /// Equirectangular image with this width, twice as wide as high.
    Equirect(u32),
}

impl SourceShape {
    /// Shape of an image, or the reason why it cannot be a source.
    pub(super) fn of(image: &Image) -> Result<Self, String> {
        let texture = &image.texture_descriptor;
        let size = texture.size;
        let (width, height, layers) = (size.width, size.height, size.depth_or_array_layers);
        let is_float = matches!(texture.format.sample_type(None, None), Some(TextureSampleType::Float { .. }));
        if !is_float || texture.dimension != TextureDimension::D2 || texture.sample_count != 1 {
            return Err(format!(
                "LiveEnvironment.source has the format {:?} ({:?}, {} samples); give a color image, for example \
                 Rgba16Float",
                texture.format, texture.dimension, texture.sample_count
            ));
        }
        if !texture.usage.contains(TextureUsages::TEXTURE_BINDING) {
            return Err(
                "LiveEnvironment.source cannot be read by shaders; add TextureUsages::TEXTURE_BINDING".to_owned()
            );
        }
        let shape = match layers {
            6 if width == height && width > 0 => Self::Cube(width),
            1 if width == 2 * height && height > 0 => Self::Equirect(width),
            _ => {
                return Err(format!(
                    "LiveEnvironment.source is {width} × {height} with {layers} layers; give a cube map (six square \
                     layers) or an equirectangular image (twice as wide as high)"
                ));
            }
        };
        let is_wide_float = matches!(texture.format, TextureFormat::Rgba32Float | TextureFormat::R32Float);
        if is_wide_float && matches!(shape, Self::Cube(_)) && !shape.is_ready() {
            return Err(format!(
                "LiveEnvironment.source is a cube of 32-bit floats with {width} texels along an edge; give it 16-bit \
                 floats or a power of two from 16 to 8192"
            ));
        }
        Ok(shape)
    }

    /// Whether the source is filtered as it is, without resampling.
    pub(super) fn is_ready(self) -> bool {
        matches!(self, Self::Cube(edge) if edge.is_power_of_two() && CUBE_EDGES.contains(&edge))
    }

    /// Edge length of the cube that is filtered.
    pub(super) fn cube_edge(self) -> u32 {
        let edge = match self {
            Self::Cube(edge) if self.is_ready() => return edge,
            Self::Cube(edge) => edge,
            Self::Equirect(width) => width / 4,
        };
        edge.max(1).next_power_of_two().clamp(*CUBE_EDGES.start(), MAX_RESAMPLED_EDGE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_sizes_become_the_next_power_of_two() {
        assert_eq!(SourceShape::Cube(100).cube_edge(), 128);
        assert_eq!(SourceShape::Equirect(1024).cube_edge(), 256);
        assert_eq!(SourceShape::Equirect(10).cube_edge(), 16);
        assert_eq!(SourceShape::Cube(2048).cube_edge(), 2048);
        assert!(SourceShape::Cube(2048).is_ready() && !SourceShape::Cube(8).is_ready());
    }
}
