//! Frames that are larger than a texture of the device can be are scaled down before anything uses them, so that
//! background, markers, ball and intrinsics stay consistent.

use super::{CameraFrame, FramePixels, srgb_to_linear};
use crate::image_files::shrink;
use bevy::{platform::collections::HashSet, prelude::*, render::renderer::RenderDevice};
use std::sync::{Arc, LazyLock};

impl FramePixels {
    /// Scales the frame down, in linear light, until neither side is longer than `max_edge` pixels (at least 1).
    /// Returns a smaller frame unchanged.
    ///
    /// ```
    /// # use bevy::math::UVec2;
    /// # use bevy_mirrorball::camera::FramePixels;
    /// let wide = FramePixels::new(UVec2::new(400, 300), vec![128; 4 * 400 * 300]).expect("fits");
    /// assert_eq!(wide.limited_to(100).size, UVec2::new(100, 75));
    /// ```
    pub fn limited_to(self, max_edge: u32) -> Self {
        let longest = self.size.max_element();
        if longest <= max_edge {
            return self;
        }
        let scale = f64::from(max_edge.max(1)) / f64::from(longest);
        let size = (self.size.as_dvec2() * scale).round().as_uvec2().max(UVec2::ONE);
        let mut rgba = Vec::with_capacity(4 * size.x as usize * size.y as usize);
        shrink(
            self.size,
            size,
            |x, y| self.linear(x as i32, y as i32),
            |row| {
                for pixel in row {
                    let [r, g, b] = pixel.to_array().map(linear_to_srgb);
                    rgba.extend([r, g, b, 255]);
                }
            },
        );
        Self { size, rgba }
    }
}

/// sRGB byte nearest to a linear value.
fn linear_to_srgb(value: f32) -> u8 {
    LINEAR_TO_SRGB[(value.clamp(0.0, 1.0) * TABLE_END as f32 + 0.5) as usize]
}

/// The darkest two codes are 20 entries of this table apart.
const TABLE_END: usize = 65535;

/// sRGB byte nearest to each linear value; the last one is white.
pub(super) static LINEAR_TO_SRGB: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let mut code = 0;
    let entry = |i: usize| {
        let value = i as f32 / TABLE_END as f32;
        while code < 255 && value > 0.5 * (srgb_to_linear(code) + srgb_to_linear(code + 1)) {
            code += 1;
        }
        code
    };
    (0..=TABLE_END).map(entry).collect()
});

/// Cameras and sizes of frames that were reported as too large.
#[derive(Resource, Default)]
pub(super) struct ReportedSizes(HashSet<(Entity, UVec2)>);

impl ReportedSizes {
    /// Scales pixels down if they are larger than textures of the device, and says so once for each camera and size.
    pub(super) fn limit(&mut self, camera: Entity, pixels: &mut Arc<FramePixels>, device: Option<&RenderDevice>) {
        let Some(max_edge) = device.map(|device| device.limits().max_texture_dimension_2d) else { return };
        let size = pixels.size;
        if size.max_element() <= max_edge {
            return;
        }
        let whole =
            Arc::try_unwrap(std::mem::replace(pixels, Arc::new(FramePixels { size: UVec2::ONE, rgba: vec![0; 4] })));
        let whole = whole.unwrap_or_else(|shared| FramePixels { size, rgba: shared.rgba.clone() });
        *pixels = Arc::new(whole.limited_to(max_edge));
        if self.0.insert((camera, size)) {
            let UVec2 { x, y } = pixels.size;
            warn!(
                "camera {camera}: frames of {} × {} pixels are larger than the textures of this device, which end at \
                 {max_edge}; they are scaled down to {x} × {y}. Smaller frames cost less",
                size.x, size.y
            );
        }
    }
}

/// Scales down the frames that the game inserts itself; those of feeds are scaled when they arrive.
pub(super) fn limit_frames(
    mut frames: Query<(Entity, &mut CameraFrame), Changed<CameraFrame>>,
    device: Option<Res<RenderDevice>>,
    mut reported: ResMut<ReportedSizes>,
) {
    for (camera, mut frame) in &mut frames {
        reported.limit(camera, &mut frame.pixels, device.as_deref());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_survives_the_way_to_linear_and_back() {
        for code in 0..=255 {
            assert_eq!(linear_to_srgb(srgb_to_linear(code)), code);
        }
    }

    #[test]
    fn a_frame_is_averaged_in_linear_light() {
        let rows: Vec<u8> = (0..6).flat_map(|i| [[0, 0, 0, 255], [255; 4]][i % 2]).collect();
        let frame = FramePixels::new(UVec2::new(6, 1), rows).expect("fits").limited_to(3);
        assert_eq!((frame.size, frame.rgb8(1, 0)), (UVec2::new(3, 1), [188; 3]));
        let gray = FramePixels::new(UVec2::new(7, 5), vec![90; 140]).expect("fits").limited_to(4);
        assert_eq!(gray.size, UVec2::new(4, 3));
        assert!((0..12).all(|i| gray.rgb8(i % 4, i / 4) == [90; 3]));
    }
}
