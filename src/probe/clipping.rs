//! Which pixels the camera clipped, and how much brighter than white they may be.

use crate::camera::{FramePixels, srgb_to_linear};
use bevy::prelude::*;

/// sRGB bytes from here on count as clipped; one step of noise below white still does.
pub(super) const CLIPPED_FROM: u8 = 254;
/// A clipped channel is taken for at most this many times the brightest channel of the pixel that is not clipped: lamps and
/// skies are not more saturated, and a pixel that clips in one channel only is no lamp.
pub(crate) const MAX_SATURATION: f32 = 4.0;
/// A pixel with a clipped channel and at least this luminance is clipped in all channels: webcams compress color more than
/// brightness, and the edge of a white lamp comes out tinted.
pub(crate) const WHITE_FROM: f32 = 0.94;
/// Weights of linear red, green and blue in luminance (ITU-R BT.709).
const LUMINANCE: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// For each clipped channel of a pixel, the largest gain it may get. Twin of `recovered` in `frame_sampling.wgsl`.
pub(crate) fn gain_limits(linear: Vec3) -> [Option<f32>; 3] {
    let channels = linear.to_array();
    if linear.max_element() < clipped_from_linear() {
        return [None; 3];
    }
    if linear.dot(LUMINANCE) >= WHITE_FROM {
        return [Some(f32::INFINITY); 3];
    }
    let unclipped = channels.into_iter().filter(|&value| value < clipped_from_linear());
    let limit = MAX_SATURATION * unclipped.fold(0.0, f32::max);
    channels.map(|value| (value >= clipped_from_linear()).then(|| (limit / value).max(1.0)))
}

/// Linear values from here on are clipped: halfway below the first clipped code, so that rounding cannot miss it.
pub(crate) fn clipped_from_linear() -> f32 {
    0.5 * (srgb_to_linear(CLIPPED_FROM - 1) + srgb_to_linear(CLIPPED_FROM))
}

/// Whether the camera could not tell how bright a pixel is.
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
