//! Tempo over the song: how far beats are apart, at every second.
//!
//! Onset strength enters, and beat periods leave. Each stretch of a few seconds has an autocorrelation (Ellis 2007);
//! the period of the beat is one whose first multiples all line up, so it scores the geometric mean of theirs,
//! weighed with a log-normal prior about 120 beats a minute. The path through the stretches is the most likely one
//! (Viterbi 1967) when tempo seldom changes.

use super::onsets::OnsetStrength;

/// Tempos that are considered, in beats per minute.
const TEMPOS: [f64; 2] = [56.0, 190.0];
/// Candidates per octave of tempo.
const STEPS_PER_OCTAVE: f64 = 60.0;
/// Middle of the prior in beats per minute, and its standard deviation in octaves.
const USUAL_TEMPO: f64 = 120.0;
const PRIOR_OCTAVES: f64 = 0.65;
/// Multiples of a period that have to line up: the beats of a measure.
const MULTIPLES: usize = 4;
/// Length of a stretch, and distance between stretches, in seconds.
const STRETCH_SECONDS: f64 = 10.0;
const STEP_SECONDS: f64 = 1.0;
/// A change of tempo is found to within this many seconds.
const CHANGE_SECONDS: f64 = 2.5;
/// Onset frames are pooled to this many seconds, which is fine enough for periods and four times as fast.
const POOL_SECONDS: f64 = 0.010;
/// Autocorrelation that counts as none, as a fraction of the power.
const FLOOR: f64 = 0.01;
/// Cost of a sudden change of tempo and of a gradual one, in nepers of likelihood.
const JUMP_COST: f64 = 25.0;
const DRIFT_COST: f64 = 0.4;

/// Beat periods of a song.
pub(crate) struct Periods {
    /// Period in seconds for each step of [`STEP_SECONDS`].
    steps: Vec<f64>,
}

impl Periods {
    /// Finds the periods. `None` if the song has no onset at all.
    pub(crate) fn of(strength: &OnsetStrength, hop_seconds: f64) -> Option<Self> {
        let pool = (POOL_SECONDS / hop_seconds).round().max(1.0) as usize;
        let pooled: Vec<f32> = strength.of_beats().chunks(pool).map(|chunk| chunk.iter().sum::<f32>()).collect();
        if pooled.iter().all(|value| *value <= 0.0) {
            return None;
        }
        let lag_seconds = hop_seconds * pool as f64;
        let periods = candidates();
        let steps = (pooled.len() as f64 * lag_seconds / STEP_SECONDS).ceil() as usize;
        let scores: Vec<Vec<f64>> = (0..steps.max(1))
            .map(|step| {
                let center = step as f64 * STEP_SECONDS / lag_seconds;
                let correlation = autocorrelation(stretch(&pooled, center, lag_seconds), lag_seconds);
                periods.iter().map(|period| likelihood(&correlation, period / lag_seconds, *period)).collect()
            })
            .collect();
        Some(Self { steps: most_likely_path(&scores).into_iter().map(|candidate| periods[candidate]).collect() })
    }

    /// Periods in seconds about a time in seconds: where the tempo changes, either may hold for a while.
    pub(crate) fn near(&self, seconds: f64) -> [f64; 3] {
        [-CHANGE_SECONDS, 0.0, CHANGE_SECONDS].map(|offset| self.at(seconds + offset))
    }

    fn at(&self, seconds: f64) -> f64 {
        let step = (seconds / STEP_SECONDS).round().clamp(0.0, (self.steps.len() - 1) as f64);
        self.steps[step as usize]
    }
}

fn candidates() -> Vec<f64> {
    let octaves = (TEMPOS[1] / TEMPOS[0]).log2();
    let count = (octaves * STEPS_PER_OCTAVE) as usize;
    (0..=count).map(|i| 60.0 / TEMPOS[1] * 2f64.powf(i as f64 / STEPS_PER_OCTAVE)).collect()
}

/// Frames around a center.
fn stretch(pooled: &[f32], center: f64, lag_seconds: f64) -> &[f32] {
    let half = 0.5 * STRETCH_SECONDS / lag_seconds;
    // At both ends of the song the stretch is moved, not cut.
    let center = center.min(pooled.len() as f64 - half).max(half);
    let start = (center - half) as usize;
    &pooled[start.min(pooled.len())..((center + half) as usize).min(pooled.len())]
}

/// Autocorrelation by lag, 1 at lag 0.
fn autocorrelation(frames: &[f32], lag_seconds: f64) -> Vec<f64> {
    let mean = frames.iter().sum::<f32>() / frames.len().max(1) as f32;
    let centered: Vec<f32> = frames.iter().map(|value| value - mean).collect();
    let lags = (MULTIPLES as f64 * 60.0 / TEMPOS[0] / lag_seconds) as usize + 2;
    let product = |lag: usize| -> f64 {
        let Some(count) = centered.len().checked_sub(lag).filter(|count| *count > 0) else { return 0.0 };
        let sum: f32 = centered[lag..].iter().zip(&centered).map(|(a, b)| a * b).sum();
        f64::from(sum) / count as f64
    };
    let power = product(0).max(1e-12);
    (0..lags).map(|lag| product(lag) / power).collect()
}

/// Logarithm of how likely a period is.
fn likelihood(correlation: &[f64], lags: f64, period: f64) -> f64 {
    let matches: f64 = (1..=MULTIPLES)
        .map(|multiple| {
            let lag = multiple as f64 * lags;
            // The best near a multiple: a period between two candidates loses nothing.
            let slack = (0.5 * lag * (2f64.powf(1.0 / STEPS_PER_OCTAVE) - 1.0)).max(0.5);
            let near = (lag - slack).round() as usize..=(lag + slack).round() as usize;
            near.filter_map(|lag| correlation.get(lag)).copied().fold(FLOOR, f64::max).ln()
        })
        .sum();
    let octaves = (60.0 / period / USUAL_TEMPO).log2() / PRIOR_OCTAVES;
    matches / MULTIPLES as f64 - 0.5 * octaves * octaves
}

fn change_cost(from: usize, to: usize) -> f64 {
    match from.abs_diff(to) {
        0 => 0.0,
        1 => DRIFT_COST,
        _ => JUMP_COST,
    }
}

/// Most likely sequence of candidates.
fn most_likely_path(scores: &[Vec<f64>]) -> Vec<usize> {
    let count = scores[0].len();
    let mut total = scores[0].clone();
    let mut origins: Vec<Vec<usize>> = Vec::with_capacity(scores.len());
    for step in &scores[1..] {
        let best = (0..count).max_by(|a, b| total[*a].total_cmp(&total[*b])).unwrap_or(0);
        let worth = |from: usize, to: usize| total[from] - change_cost(from, to);
        let origin: Vec<usize> = (0..count)
            .map(|to| {
                let near = to.saturating_sub(1)..(to + 2).min(count);
                near.chain([best]).max_by(|a, b| worth(*a, to).total_cmp(&worth(*b, to))).unwrap_or(to)
            })
            .collect();
        total = (0..count).map(|to| worth(origin[to], to) + step[to]).collect();
        origins.push(origin);
    }
    let mut at = (0..count).max_by(|a, b| total[*a].total_cmp(&total[*b])).unwrap_or(0);
    let mut path = vec![at];
    for origin in origins.iter().rev() {
        at = origin[at];
        path.push(at);
    }
    path.reverse();
    path
}
