//! What charts of each difficulty may have.

use crate::song::Difficulty;
use std::ops::Range;

/// How many slots of one kind a measure may take, and what they need.
pub(crate) struct Quota {
    /// Arrows of this kind in a quiet measure and in a busy one.
    pub count: [f32; 2],
    /// Least salience of what begins there (0 to 1.5); 0 lets the beat be felt only.
    pub min_salience: f32,
}

/// Limits of a difficulty.
pub(crate) struct Level {
    pub beats: Quota,
    pub half_beats: Quota,
    pub quarter_beats: Quota,
    /// Least distance between arrows in seconds.
    pub min_gap: f64,
    /// Jumps in a busy phrase of four measures.
    pub jumps: f32,
    /// Whether long notes are held.
    pub has_holds: bool,
    /// Probability weight of a step of the same foot from Up to Down or back, against 1 for others.
    pub candle: f32,
    /// The same of a foot on the other foot's side.
    pub crossover: f32,
    /// Meters of a slow and of a fast chart.
    pub meters: Range<u32>,
}

impl Level {
    pub(crate) fn of(difficulty: Difficulty) -> Self {
        let none = || Quota { count: [0.0, 0.0], min_salience: f32::INFINITY };
        match difficulty {
            // The beat is felt where nothing sounds, so beats need no onset.
            Difficulty::Easy => Self {
                beats: Quota { count: [1.0, 4.0], min_salience: 0.0 },
                half_beats: none(),
                quarter_beats: none(),
                min_gap: 0.30,
                jumps: 0.0,
                has_holds: false,
                candle: 0.0,
                crossover: 0.0,
                meters: 1..4,
            },
            Difficulty::Medium => Self {
                beats: Quota { count: [2.0, 4.0], min_salience: 0.0 },
                half_beats: Quota { count: [0.0, 3.0], min_salience: 0.35 },
                quarter_beats: none(),
                min_gap: 0.20,
                jumps: 1.5,
                has_holds: true,
                candle: 0.3,
                crossover: 0.0,
                meters: 3..7,
            },
            Difficulty::Hard => Self {
                beats: Quota { count: [3.0, 4.0], min_salience: 0.05 },
                half_beats: Quota { count: [2.0, 4.0], min_salience: 0.2 },
                quarter_beats: Quota { count: [1.0, 5.0], min_salience: 0.4 },
                min_gap: 0.11,
                jumps: 4.0,
                has_holds: true,
                candle: 0.5,
                crossover: 0.06,
                meters: 6..11,
            },
        }
    }
}
