//! Weights of a discrete blur with an exact standard deviation.

/// Largest radius in pixels.
pub(super) const MAX_RADIUS: usize = 8;
/// Largest standard deviation in pixels, at which the kernel still ends within the radius.
pub(super) const MAX_DEVIATION: f32 = 2.8;
/// Weight of the outermost pixel below which a kernel is cut off.
const MIN_WEIGHT: f64 = 0.002;

/// Weights of the pixels at the distances 0, 1, 2 … along one axis, which add up to 1 with those on the other side;
/// zeros beyond the radius, which comes with them.
///
/// A Gaussian that is sampled at the pixels has less variance than it should if it is narrow. This one is as wide as is
/// needed for the variance of the weights themselves to be right.
pub(super) fn blur_kernel(deviation: f32) -> ([f32; MAX_RADIUS + 1], usize) {
    let wanted = f64::from(deviation.clamp(0.0, MAX_DEVIATION)).powi(2);
    let (mut low, mut high) = (0.0, 8.0);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if variance(&sampled(middle)) < wanted { low = middle } else { high = middle }
    }
    let weights = sampled(0.5 * (low + high));
    let radius = (1..=MAX_RADIUS).rev().find(|i| weights[*i] > MIN_WEIGHT).unwrap_or(0);
    let sum = weights[0] + 2.0 * weights[1..=radius].iter().sum::<f64>();
    let weight = |i: usize| if i <= radius { (weights[i] / sum) as f32 } else { 0.0 };
    (std::array::from_fn(weight), radius)
}

fn sampled(deviation: f64) -> [f64; MAX_RADIUS + 1] {
    let values: [f64; MAX_RADIUS + 1] =
        std::array::from_fn(|i| (-0.5 * (i as f64 / deviation.max(1e-3)).powi(2)).exp());
    let sum = values[0] + 2.0 * values[1..].iter().sum::<f64>();
    values.map(|value| value / sum)
}

fn variance(weights: &[f64]) -> f64 {
    2.0 * weights.iter().enumerate().map(|(i, weight)| weight * (i * i) as f64).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_are_as_wide_as_asked_for() {
        for deviation in [0.0_f32, 0.2, 0.4, 0.7, 1.0, 1.7, 2.5] {
            let (weights, radius) = blur_kernel(deviation);
            let weights = weights.map(f64::from);
            let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
            let found = variance(&weights).sqrt();
            assert!(
                (sum - 1.0).abs() < 1e-6 && (found - f64::from(deviation)).abs() < 1e-4 + 0.03 * f64::from(deviation)
            );
            assert!(radius <= MAX_RADIUS && (radius == 0) == (deviation == 0.0), "{deviation}: {radius}");
        }
    }
}
