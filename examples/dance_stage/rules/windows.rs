//! Timing windows: how far from its time a step may be for each grade.
//!
//! Values are StepMania's: ±22.5, 45, 90, 135 and 180 ms, and 250 ms to step back on a hold (`Player.cpp`). StepMania
//! numbers the windows W1 to W5 and leaves the names to themes. Those here are known from arcades: Marvelous, Perfect,
//! Great, Good, Almost.

/// Grade of a step, from best to worst.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Grade {
    Marvelous,
    Perfect,
    Great,
    Good,
    Almost,
    Miss,
}

impl Grade {
    pub(crate) const COUNT: usize = 6;
    pub(crate) const ALL: [Self; Self::COUNT] =
        [Self::Marvelous, Self::Perfect, Self::Great, Self::Good, Self::Almost, Self::Miss];

    pub(crate) fn index(self) -> usize {
        self as usize
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Marvelous => "Marvelous",
            Self::Perfect => "Perfect",
            Self::Great => "Great",
            Self::Good => "Good",
            Self::Almost => "Almost",
            Self::Miss => "Miss",
        }
    }

    /// Whether a step of this grade continues a combo.
    pub(crate) fn keeps_combo(self) -> bool {
        self <= Self::Great
    }
}

/// Grade of a hold whose beginning was hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum HoldGrade {
    /// Held to its end.
    Held,
    /// Left for longer than allowed.
    LetGo,
}

impl HoldGrade {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Held => "OK",
            Self::LetGo => "NG",
        }
    }
}

/// Window of each grade but the miss, in seconds to either side.
const WINDOW_SECONDS: [(Grade, f64); 5] = [
    (Grade::Marvelous, 0.0225),
    (Grade::Perfect, 0.045),
    (Grade::Great, 0.090),
    (Grade::Good, 0.135),
    (Grade::Almost, 0.180),
];
const LET_GO_SECONDS: f64 = 0.250;
/// Rounding error of differences of song times: a step at a window's edge is within it.
const ROUNDING_SECONDS: f64 = 1e-9;

/// Timing windows of a game.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TimingWindows {
    scale: f64,
}

impl Default for TimingWindows {
    fn default() -> Self {
        Self { scale: 1.0 }
    }
}

impl TimingWindows {
    pub(crate) const MIN_SCALE: f64 = 0.25;
    pub(crate) const MAX_SCALE: f64 = 4.0;

    /// Returns the windows of StepMania times `scale`, which is clamped to 0.25 to 4: above 1 is easier.
    pub(crate) fn scaled(scale: f64) -> Self {
        let scale = if scale.is_nan() { 1.0 } else { scale };
        Self { scale: scale.clamp(Self::MIN_SCALE, Self::MAX_SCALE) }
    }

    /// Returns the grade of a step by how late it is in seconds, negative for early. `None` outside of all windows.
    pub(crate) fn grade(&self, error_seconds: f64) -> Option<Grade> {
        let fits = |window: f64| error_seconds.abs() <= window * self.scale + ROUNDING_SECONDS;
        WINDOW_SECONDS.into_iter().find(|(_, window)| fits(*window)).map(|(grade, _)| grade)
    }

    /// Returns the time before and after an arrow in which a step can hit it, in seconds.
    pub(crate) fn widest_seconds(&self) -> f64 {
        let [.., (_, widest)] = WINDOW_SECONDS;
        widest * self.scale + ROUNDING_SECONDS
    }

    /// Returns how long a foot may be off a hold, in seconds.
    pub(crate) fn let_go_seconds(&self) -> f64 {
        LET_GO_SECONDS * self.scale
    }
}
