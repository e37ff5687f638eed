//! Clipping: detection of clipped pixels, and upper bounds of their true brightness.

use crate::{
    camera::{FramePixels, srgb_to_linear},
    luminance::luminance,
};
use glam::Vec3;

/// Smallest sRGB byte that counts as clipped, one step of noise below white.
pub(super) const CLIPPED_FROM: u8 = 254;
/// Upper bound of the ratio of a clipped channel to the brightest unclipped channel of the pixel: lamps and skies are
/// not more saturated, and a pixel that clips in one channel only is no lamp.
pub(crate) const MAX_SATURATION: f32 = 4.0;
/// Luminance from which a pixel with one clipped channel counts as clipped in all channels: webcams compress color more
/// than brightness, so the edge of a white lamp comes out tinted.
pub(crate) const WHITE_FROM: f32 = 0.94;

/// Largest gain allowed for each channel of a pixel; `None` for unclipped channels. Twin of `recovered` in
/// `unwrap/frame_sampling.wgsl`.
pub(crate) fn gain_limits(linear: Vec3) -> [Option<f32>; 3] {
    let channels = linear.to_array();
    if linear.max_element() < clipped_from_linear() {
        return [None; 3];
    }
    if luminance(linear) >= WHITE_FROM {
        return [Some(f32::INFINITY); 3];
    }
    let unclipped = channels.into_iter().filter(|&value| value < clipped_from_linear());
    let limit = MAX_SATURATION * unclipped.fold(0.0, f32::max);
    channels.map(|value| (value >= clipped_from_linear()).then(|| (limit / value).max(1.0)))
}

/// Smallest linear value that counts as clipped: halfway below the first clipped code, so that rounding cannot miss it.
pub(crate) fn clipped_from_linear() -> f32 {
    0.5 * (srgb_to_linear(CLIPPED_FROM - 1) + srgb_to_linear(CLIPPED_FROM))
}

/// Whether a pixel is clipped in at least one channel.
pub(super) fn is_clipped(frame: &FramePixels, x: i32, y: i32) -> bool {
    frame.rgb8(x, y).into_iter().any(|value| value >= CLIPPED_FROM)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_clipped_in_one_channel_stays_near_the_others() {
        let orange = Vec3::new(1.0, 0.5, 0.1);
        assert_eq!(gain_limits(orange), [Some(MAX_SATURATION * 0.5), None, None]);
        assert_eq!(gain_limits(Vec3::new(0.9, 0.95, 0.98)), [None; 3]);
    }

    #[test]
    fn the_tinted_rim_of_a_white_lamp_is_clipped_in_all_channels() {
        let rim = Vec3::new(srgb_to_linear(255), srgb_to_linear(250), srgb_to_linear(219));
        assert_eq!(gain_limits(rim), [Some(f32::INFINITY); 3]);
    }
}
