//! Width of the edges in a frame, from the sides of a printed marker.
//!
//! A side of the black square is a straight, sharp edge between ink and paper; its picture is as wide as lens, sensor
//! and motion make edges. As in ISO 12233, all pixels beside the slanted edge together sample its profile finer than
//! the pixels are; a Gaussian edge is fitted to it, in linear light.

use crate::{camera::FramePixels, least_squares::NormalEquations};
use bevy::math::DVec2;

/// Half width of the strip along a side, as a fraction of the side: within the ink and the margin of all families.
const STRIP: f64 = 0.1;
/// Largest and smallest half width of the strip in pixels.
const MAX_STRIP: f64 = 9.0;
const MIN_STRIP: f64 = 3.0;
/// Part of a side that is left out at each end, beside its half width.
const CORNERS: f64 = 0.08;
/// Smallest difference of ink and paper, in linear camera units.
const MIN_CONTRAST: f64 = 0.1;
/// Largest deviation from the fit, relative to that difference.
const MAX_RESIDUAL: f64 = 0.1;
/// Largest fraction of pixels that may be clipped.
const MAX_CLIPPED: f64 = 0.05;
/// Widths that a fit may have, in pixels.
const WIDTHS: std::ops::RangeInclusive<f64> = 0.15..=6.0;
const STEPS: usize = 30;

/// Standard deviation in pixels of the blur at the edges of a marker, that of the pixels' own area included: the
/// median of its sides. `None` if no side is large, sharp and unclipped enough.
pub(super) fn edge_width(frame: &FramePixels, corners: &[DVec2; 4]) -> Option<f32> {
    let sides = (0..4).filter_map(|i| side_width(frame, corners[i], corners[(i + 1) % 4]));
    let mut widths: Vec<f64> = sides.collect();
    widths.sort_unstable_by(f64::total_cmp);
    let middle = widths.len().checked_sub(1)? / 2;
    Some((0.5 * (widths[middle] + widths[widths.len() / 2])) as f32)
}

/// A pixel beside an edge.
struct Sample {
    /// Place along the edge, −1…1.
    along: f64,
    /// Distance from the line between the corners, in pixels.
    across: f64,
    value: f64,
}

fn side_width(frame: &FramePixels, from: DVec2, to: DVec2) -> Option<f64> {
    let length = from.distance(to);
    let strip = (STRIP * length).min(MAX_STRIP);
    if strip.is_nan() || strip < MIN_STRIP {
        return None;
    }
    let (along, middle) = ((to - from) / length, 0.5 * (from + to));
    let reach = 0.5 * length * (1.0 - 2.0 * CORNERS) - strip;
    let (low, high) = (from.min(to) - strip, from.max(to) + strip);
    if low.min_element() < 0.0 || high.x > f64::from(frame.size.x) || high.y > f64::from(frame.size.y) {
        return None;
    }
    let (mut samples, mut clipped) = (Vec::new(), 0);
    for y in low.y as i32..=high.y as i32 {
        for x in low.x as i32..=high.x as i32 {
            let offset = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) - middle;
            let (t, across) = (offset.dot(along), offset.perp_dot(along));
            if t.abs() <= reach && across.abs() <= strip {
                let value = f64::from(frame.linear(x, y).y);
                clipped += usize::from(frame.rgb8(x, y).contains(&255));
                samples.push(Sample { along: t / reach, across, value });
            }
        }
    }
    let is_clipped = clipped as f64 > MAX_CLIPPED * samples.len() as f64;
    (!is_clipped).then(|| fit(&samples, strip)).flatten()
}

/// Width of the Gaussian edge through some samples, by damped Gauss-Newton steps.
fn fit(samples: &[Sample], strip: f64) -> Option<f64> {
    let mean = |side: f64| {
        let far = samples.iter().filter(|sample| sample.across * side > 0.6 * strip);
        let (sum, count) = far.fold((0.0, 0.0), |(sum, count), sample| (sum + sample.value, count + 1.0));
        (count > 0.0).then_some(sum / count)
    };
    // Value of the lower side, difference, shift at the middle, change of the shift along the edge, width.
    let mut edge = [mean(-1.0)?, mean(1.0)? - mean(-1.0)?, 0.0, 0.0, 1.0];
    if edge[1].abs() < MIN_CONTRAST {
        return None;
    }
    for _ in 0..STEPS {
        let mut equations = NormalEquations::new(5);
        for sample in samples {
            let place = (sample.across - edge[2] - edge[3] * sample.along) / edge[4];
            let covered = normal_integral(place);
            let slope = edge[1] * (-0.5 * place * place).exp() / (std::f64::consts::TAU.sqrt() * edge[4]);
            let row = [1.0, covered, -slope, -slope * sample.along, -slope * place];
            let residual = sample.value - edge[0] - edge[1] * covered;
            equations.add(&std::array::from_fn::<_, 5, _>(|i| (i, row[i])), residual, 1.0);
        }
        // Keeps what the samples do not determine.
        (0..5).for_each(|i| equations.add(&[(i, 1.0)], 0.0, 1e-4 * edge[1] * edge[1]));
        let step = equations.solve_unbounded()?;
        edge.iter_mut().zip(&step).for_each(|(value, step)| *value += step);
        edge[4] = edge[4].clamp(*WIDTHS.start(), *WIDTHS.end());
        if step[4].abs() < 1e-4 {
            break;
        }
    }
    let residual = |sample: &Sample| {
        let place = (sample.across - edge[2] - edge[3] * sample.along) / edge[4];
        (sample.value - edge[0] - edge[1] * normal_integral(place)).powi(2)
    };
    let deviation = (samples.iter().map(residual).sum::<f64>() / samples.len() as f64).sqrt();
    let is_good = deviation < MAX_RESIDUAL * edge[1].abs() && edge[2].abs() < 0.5 * strip && 2.0 * edge[4] < strip;
    is_good.then_some(edge[4])
}

/// Integral of the normal distribution up to a value (Abramowitz and Stegun 7.1.26, exact to 1e-7).
fn normal_integral(value: f64) -> f64 {
    let x = value.abs() / std::f64::consts::SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * x);
    let polynomial =
        t * (0.254_829_592 + t * (-0.284_496_736 + t * (1.421_413_741 + t * (-1.453_152_027 + t * 1.061_405_429))));
    let upper = 0.5 * polynomial * (-x * x).exp();
    if value < 0.0 { upper } else { 1.0 - upper }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::prelude::*;

    const SIZE: UVec2 = UVec2::new(160, 140);
    const SUBPIXELS: i32 = 5;

    fn encoded(linear: f64) -> f64 {
        255.0 * if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
    }

    /// A black square, turned and off the grid of pixels, blurred and noisy, and its corners.
    fn square(blur: f64, noise: f64) -> (FramePixels, [DVec2; 4]) {
        let (center, half, turn) = (DVec2::new(81.3, 70.6), 45.0, DVec2::from_angle(0.13));
        let coverage = |offset: DVec2| {
            let place = DVec2::new(turn.x, -turn.y).rotate(offset);
            let inside = |x: f64| normal_integral((half - x) / blur) - normal_integral((-half - x) / blur);
            inside(place.x) * inside(place.y)
        };
        let pixel = |i: u32| {
            let (x, y) = (f64::from(i % SIZE.x), f64::from(i / SIZE.x));
            let part = |k: i32| (f64::from(k) + 0.5) / f64::from(SUBPIXELS);
            let parts = (0..SUBPIXELS * SUBPIXELS).map(|k| DVec2::new(part(k % SUBPIXELS), part(k / SUBPIXELS)));
            let ink = parts.map(|part| coverage(DVec2::new(x, y) + part - center)).sum::<f64>();
            let ink = ink / f64::from(SUBPIXELS * SUBPIXELS);
            let random = f64::from(super::super::noise_tile::hash(i)) / f64::from(u32::MAX) - 0.5;
            let value = encoded(0.7 - 0.66 * ink) + noise * 12_f64.sqrt() * random;
            [value.round().clamp(0.0, 255.0) as u8; 4]
        };
        let pixels = (0..SIZE.element_product()).flat_map(pixel).collect();
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = corners.map(|(x, y)| center + turn.rotate(half * DVec2::new(x, y)) + DVec2::new(0.2, -0.15));
        (FramePixels::new(SIZE, pixels).expect("as many as the size says"), corners)
    }

    #[test]
    fn known_blur_is_measured_with_the_area_of_the_pixels() {
        for noise in [0.0, 3.0] {
            for blur in [0.3_f64, 0.5, 1.0, 1.7, 2.5] {
                let (frame, corners) = square(blur, noise);
                let expected = (blur * blur + 1.0 / 12.0).sqrt();
                let found = edge_width(&frame, &corners).expect("the sides are clear");
                println!("noise {noise}, blur {blur}: {expected} expected, {found} found");
                assert!((f64::from(found) / expected - 1.0).abs() < 0.1);
            }
        }
    }

    #[test]
    fn without_a_clear_side_there_is_no_width() {
        let gray = FramePixels::new(SIZE, vec![120; 4 * SIZE.element_product() as usize]).expect("as many as needed");
        let (frame, corners) = square(1.0, 0.0);
        assert_eq!(edge_width(&gray, &corners), None);
        assert_eq!(edge_width(&frame, &corners.map(|corner| 0.1 * corner)), None, "too small");
        assert_eq!(edge_width(&frame, &corners.map(|corner| corner + DVec2::splat(80.0))), None, "outside");
        assert_eq!(edge_width(&frame, &[DVec2::NAN; 4]), None);
    }
}
