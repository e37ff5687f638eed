//! Tile of noise that repeats without seams, in octaves of unit variance.

/// Width and height of the tile in pixels. Twin of `TILE` in `grain_pass.wgsl`.
pub(super) const TILE: usize = 256;
/// Octaves of spatial frequency.
pub(super) const OCTAVES: usize = 3;
/// Value of noise, in standard deviations, that a texel of ±1 stands for. Larger ones, one in 16 000, are clamped. Twin
/// of `RANGE` in `grain_pass.wgsl`.
const RANGE: f32 = 4.0;
/// Channels of a texel: noise of red, green and blue alone, and noise that they share.
const CHANNELS: usize = 4;

/// Kernels with which white noise becomes the octaves: one pixel, and binomials of 0.7 and 1.6 pixels' standard
/// deviation.
const KERNELS: [&[f64]; OCTAVES] =
    [&[1.0], &[1.0, 2.0, 1.0], &[1.0, 10.0, 45.0, 120.0, 210.0, 252.0, 210.0, 120.0, 45.0, 10.0, 1.0]];

/// Kernel of an octave in one dimension, for noise of unit variance.
pub(super) fn kernel(octave: usize) -> Vec<f64> {
    let norm = KERNELS[octave].iter().map(|value| value * value).sum::<f64>().sqrt();
    KERNELS[octave].iter().map(|value| value / norm).collect()
}

/// Hash of a number (Jarzynski and Olano 2020, PCG).
pub(super) fn hash(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// A normally distributed number of variance 1, nearly: the sum of eight uniform ones.
fn normal(index: u32) -> f64 {
    let uniform = |i: u32| f64::from(hash(hash(index * 8 + i))) / f64::from(u32::MAX) - 0.5;
    (0..8).map(uniform).sum::<f64>() * 1.5_f64.sqrt()
}

/// Convolution of a periodic plane along one axis.
fn convolve(plane: &[f64], kernel: &[f64], is_vertical: bool) -> Vec<f64> {
    let half = kernel.len() / 2;
    let value = |i: usize| {
        let (x, y) = (i % TILE, i / TILE);
        let at = |offset: usize| match is_vertical {
            true => ((y + TILE + offset - half) % TILE) * TILE + x,
            false => y * TILE + (x + TILE + offset - half) % TILE,
        };
        kernel.iter().enumerate().map(|(offset, weight)| weight * plane[at(offset)]).sum()
    };
    (0..plane.len()).map(value).collect()
}

/// One channel of an octave, of mean 0 and variance 1.
fn plane(octave: usize, channel: usize) -> Vec<f64> {
    let first = ((octave * CHANNELS + channel) * TILE * TILE) as u32;
    let white: Vec<f64> = (0..(TILE * TILE) as u32).map(|i| normal(first + i)).collect();
    let kernel = kernel(octave);
    let plane = convolve(&convolve(&white, &kernel, false), &kernel, true);
    let mean = plane.iter().sum::<f64>() / plane.len() as f64;
    let variance = plane.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / plane.len() as f64;
    plane.into_iter().map(|value| (value - mean) / variance.sqrt()).collect()
}

/// Texels of all octaves one after the other, four signed normalized bytes each.
pub(super) fn texels() -> Vec<u8> {
    let byte = |value: f64| (value as f32 / RANGE * 127.0).round().clamp(-127.0, 127.0) as i8 as u8;
    let octave = |octave: usize| {
        let planes: Vec<Vec<f64>> = (0..CHANNELS).map(|channel| plane(octave, channel)).collect();
        let texel = |i: usize| planes.iter().map(|plane| byte(plane[i])).collect::<Vec<_>>();
        (0..TILE * TILE).flat_map(texel).collect::<Vec<_>>()
    };
    (0..OCTAVES).flat_map(octave).collect()
}

/// Places in the tile, one of each octave, that a frame starts from.
pub(super) fn offsets(seed: u32, sequence: u64) -> [[u32; 2]; OCTAVES] {
    let frame = hash(seed ^ hash((sequence as u32) ^ hash((sequence >> 32) as u32)));
    std::array::from_fn(|octave| {
        let place = hash(frame ^ hash(octave as u32));
        [place % TILE as u32, (place >> 16) % TILE as u32]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn octaves_have_unit_variance_and_are_correlated_as_their_kernels_are() {
        for octave in 0..OCTAVES {
            let plane = plane(octave, 1);
            let correlation = |distance: usize| {
                let pair = |i: usize| plane[i] * plane[i / TILE * TILE + (i + distance) % TILE];
                (0..plane.len()).map(pair).sum::<f64>() / plane.len() as f64
            };
            let kernel = kernel(octave);
            assert!((correlation(0) - 1.0).abs() < 1e-9);
            for distance in 1..4 {
                let expected: f64 = kernel.iter().zip(kernel.iter().skip(distance)).map(|(a, b)| a * b).sum();
                assert!((correlation(distance) - expected).abs() < 0.04, "octave {octave}, {distance} pixels");
            }
        }
    }

    #[test]
    fn frames_and_seeds_start_from_places_of_their_own() {
        assert_eq!(offsets(1, 7), offsets(1, 7));
        assert_ne!(offsets(1, 7), offsets(2, 7));
        assert_ne!(offsets(1, 7), offsets(1, 8));
    }
}
