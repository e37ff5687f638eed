//! Mean color of a frame, which shows whether a lock has changed the picture.

/// Largest ratio between two means of a channel that counts as no change; one exposure stop, about, as the means are
/// sRGB-encoded.
const MAX_RATIO: f32 = 1.4;
/// Added to both means, so that the noise of dark frames is no change.
const DARK: f32 = 4.0;
/// Every how many pixels one is looked at.
const STEP: usize = 61;

/// Mean of red, green and blue, 0 to 255, sRGB-encoded.
pub(super) fn mean_color(rgba: &[u8]) -> [f32; 3] {
    let mut sum = [0.0; 3];
    let mut count = 0.0;
    for pixel in rgba.chunks_exact(4).step_by(STEP) {
        count += 1.0;
        for (sum, value) in sum.iter_mut().zip(pixel) {
            *sum += f32::from(*value);
        }
    }
    sum.map(|sum| sum / f32::max(count, 1.0))
}

/// Whether brightness or tint have changed by so much that what the camera sees is an unlikely cause.
pub(super) fn has_changed(before: [f32; 3], after: [f32; 3]) -> bool {
    let ratio = |(a, b): (f32, f32)| (a + DARK) / (b + DARK);
    before.into_iter().zip(after).map(ratio).any(|ratio| ratio.max(1.0 / ratio) > MAX_RATIO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_that_of_the_pixels_without_alpha() {
        let stripes: Vec<u8> = (0..10_000).flat_map(|i| [10, 20 * (i % 2) as u8, 200, 255]).collect();
        let [red, green, blue] = mean_color(&stripes);
        assert_eq!((red, blue), (10.0, 200.0));
        assert!((green - 10.0).abs() < 0.1, "{green}");
        assert_eq!(mean_color(&[]), [0.0; 3]);
    }

    #[test]
    fn a_stop_of_brightness_or_a_tint_is_a_change_and_noise_in_the_dark_is_none() {
        let gray = [100.0; 3];
        assert!(!has_changed(gray, [120.0, 115.0, 90.0]));
        assert!(has_changed(gray, [60.0; 3]) && has_changed(gray, [150.0; 3]));
        assert!(has_changed(gray, [100.0, 100.0, 160.0]), "blue");
        assert!(!has_changed([0.0; 3], [1.0; 3]));
        assert!(has_changed(gray, [0.0; 3]));
    }
}
