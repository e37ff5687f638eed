//! Random numbers that are the same for the same seed, on every machine.
//!
//! Bits of the generator of Steele, Lea and Flood (2014), and normal numbers from it (Box and Muller 1958).

use std::f64::consts::TAU;

/// Generator of random numbers.
#[derive(Clone, Debug)]
pub(crate) struct Random {
    state: u64,
}

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// Makes a generator for a purpose, whose numbers differ from those for other purposes.
    pub(crate) fn for_purpose(seed: u64, purpose: u64) -> Self {
        Self { state: Self::new(seed).bits() ^ purpose }
    }

    /// Returns 64 random bits.
    pub(crate) fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// Returns a number from 0 to below 1.
    pub(crate) fn unit(&mut self) -> f64 {
        const BITS: u32 = f64::MANTISSA_DIGITS;
        (self.bits() >> (u64::BITS - BITS)) as f64 / (1_u64 << BITS) as f64
    }

    /// Returns a number from `low` to below `high`.
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Returns a whole number below `end`; 0 if that is 0.
    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.unit() * end as f64) as usize
    }

    /// Chooses an item with a probability in proportion to its weight. `None` if no weight is above zero.
    pub(crate) fn choose<T: Copy>(&mut self, items: &[(T, f32)]) -> Option<T> {
        let mut rest = self.unit() as f32 * items.iter().map(|(_, weight)| weight.max(0.0)).sum::<f32>();
        let mut last = None;
        for (item, weight) in items.iter().filter(|(_, weight)| *weight > 0.0) {
            last = Some(*item);
            rest -= weight;
            if rest < 0.0 {
                break;
            }
        }
        last
    }

    /// Returns a normal number of mean 0 and standard deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        // 1 − unit is above 0, and so its logarithm finite.
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (TAU * self.unit()).cos()
    }
}
