//! Transition from the assumed to the measured environment.

/// Smaller steps would get lost in the rounding of half floats.
const MIN_STEP: f32 = 1.0 / 64.0;

/// Fraction of the transition that the cube has completed, 0…1.
#[derive(Clone, Copy, Default, PartialEq)]
pub(super) struct Fading(f32);

impl Fading {
    /// The next state on the way to a fraction: this one while the step is too small to be stored.
    pub(super) fn toward(self, fraction: f32) -> Self {
        let is_small = fraction > self.0 && fraction < 1.0 && fraction - self.0 < MIN_STEP;
        if is_small { self } else { Self(fraction) }
    }

    /// Weight of the measured environment in the mix with the cube that leads to the next state. With it, equal steps
    /// of the fraction change the cube by equal amounts.
    pub(super) fn weight_to(self, next: Self) -> f32 {
        if next.0 >= 1.0 { 1.0 } else { ((next.0 - self.0) / (1.0 - self.0)).clamp(0.0, 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_steps_add_up_to_the_fraction() {
        let (mut fading, mut assumed) = (Fading::default(), 1.0);
        for step in 1..=4u8 {
            let next = fading.toward(0.25 * f32::from(step));
            assumed *= 1.0 - fading.weight_to(next);
            fading = next;
            assert!((assumed - (1.0 - 0.25 * f32::from(step))).abs() < 1e-6, "{assumed} after {step} steps");
        }
    }

    #[test]
    fn steps_that_half_floats_would_lose_are_saved_up() {
        let fading = Fading::default().toward(0.5);
        assert!(fading.toward(0.501) == fading && fading.toward(0.52) != fading);
        assert_eq!(fading.weight_to(fading.toward(1.0)), 1.0);
    }
}
