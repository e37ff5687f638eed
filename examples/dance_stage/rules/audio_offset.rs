//! How far the audio is ahead of the wall clock, estimated from positions that an audio device reports.
//!
//! Reported positions move in blocks: each is that of the block that is being played, so that it lags by up to a block,
//! and some noise comes on top. What is wanted is the position that is heard at this moment. Wall time and positions
//! enter, and the offset between both leaves, in seconds.
//!
//! 1. Only positions that differ clearly from the last one are used: the others are of the same block. Their lag is
//!    evenly distributed between 0 and the shorter of a block and a frame: the block began since the last frame.
//! 2. A Kalman filter (Kalman 1960) with the states offset and drift follows their middle. It weighs all readings alike
//!    at first, and knows that clocks differ by some hundred parts per million at most. It is corrected by the cube of
//!    the surprise instead of the surprise, as in a location estimate with a cubic score (Huber 1964): the edges of an
//!    even distribution tell more of where it is than its middle, so that less than half the variance is left.
//! 3. The middle lags by half the width of that distribution. The width follows from the variance of the readings about
//!    the filter: it is width²/12 for the lag, plus that of the noise, for which a usual value is taken off. It is not
//!    above the time of a frame. The largest reading instead would be biased by its noise.
//!
//! A reading far from what the filter expects is ignored, but a few in succession mean that the audio has stalled or
//! was moved: the filter starts anew.
//!
//! With noise of ±4 ms, blocks of 10 to 23 ms and 60 frames a second, the position is known to 2 ms after three
//! seconds, in all but one of a thousand simulated songs. Blocks that last as long as a frame, within some percent, are
//! the exception: each frame sees them equally late, by an unknown part of a frame, and the error can be half a frame.

/// Step from which on a position counts as that of another block, and less as noise of the same.
const MIN_STEP_SECONDS: f64 = 0.006;
/// Standard deviation of the noise of reported positions, as of an even distribution over ±3.8 ms.
const NOISE_SECONDS: f64 = 0.0022;
/// Smallest part of the width of the readings that is lag, for devices that have little of either.
const MIN_LAG_PART: f64 = 0.7;
/// First estimate of the standard deviation of readings, and the number of readings that it counts for.
const FIRST_SPREAD_SECONDS: f64 = 0.005;
const FIRST_SPREAD_READINGS: f64 = 40.0;
const FIRST_FRAME_SECONDS: f64 = 1.0 / 60.0;
/// Number of readings after which earlier ones are forgotten in their spread, about ten seconds.
const MAX_SPREAD_READINGS: f64 = 600.0;
/// Standard deviation of the drift of audio devices against the wall clock, in seconds per second.
const DRIFT_SPREAD: f64 = 150e-6;
/// Largest surprise that counts, in standard deviations; evenly distributed readings are within 1.7.
const MAX_SURPRISE_SPREADS: f64 = 2.2;
/// Variance of the cube of the surprise, scaled to a mean slope of 1, relative to that of the surprise. It is 3/7 for
/// an even distribution, and more with noise.
const CUBE_VARIANCE: f64 = 0.6;
/// Random walks of offset and drift: variances per second.
const OFFSET_WALK: f64 = 1e-10;
const DRIFT_WALK: f64 = 1e-12;
/// A reading is an outlier if it is as many standard deviations from what is expected, and by as many seconds.
const OUTLIER_SPREADS: f64 = 4.0;
const OUTLIER_SECONDS: f64 = 0.015;
/// Number of outliers in succession that start the filter anew.
const OUTLIERS_TO_RESTART: u32 = 3;

/// Estimator of the offset between the positions of an audio device and the wall clock.
#[derive(Clone, Debug)]
pub(super) struct AudioOffset {
    state: Option<State>,
    last_position: Option<f64>,
    last_wall_seconds: f64,
    /// Mean time between frames.
    frame_seconds: f64,
    /// Variance of readings about what is expected of them, and the number of readings that it is from.
    variance: f64,
    readings: f64,
    outliers: u32,
}

/// Middle of the readings of position − wall time, and its drift, with their covariance.
#[derive(Clone, Copy, Debug)]
struct State {
    wall_seconds: f64,
    offset: f64,
    drift: f64,
    offset_variance: f64,
    covariance: f64,
    drift_variance: f64,
}

impl AudioOffset {
    pub(super) fn new() -> Self {
        Self {
            state: None,
            last_position: None,
            last_wall_seconds: 0.0,
            frame_seconds: FIRST_FRAME_SECONDS,
            variance: FIRST_SPREAD_SECONDS * FIRST_SPREAD_SECONDS,
            readings: FIRST_SPREAD_READINGS,
            outliers: 0,
        }
    }

    /// Takes a reported position at a time of the wall clock. Returns whether it is that of another block than
    /// the one before.
    pub(super) fn read(&mut self, wall_seconds: f64, position: f64) -> bool {
        let frame_seconds = wall_seconds - self.last_wall_seconds;
        self.last_wall_seconds = wall_seconds;
        if self.last_position.is_some_and(|last| (position - last).abs() < MIN_STEP_SECONDS) {
            return false;
        }
        self.last_position = Some(position);
        self.correct(wall_seconds, position - wall_seconds, frame_seconds);
        true
    }

    /// Returns the position that is heard at a time of the wall clock. `None` if it is unknown: before the first
    /// reading, and after an outlier.
    pub(super) fn position_at(&self, wall_seconds: f64) -> Option<f64> {
        let spread_width = (12.0 * self.variance).sqrt().min(self.frame_seconds);
        let lag_width = (12.0 * (self.variance - NOISE_SECONDS * NOISE_SECONDS)).max(0.0).sqrt();
        let mean_lag = 0.5 * lag_width.clamp(MIN_LAG_PART * spread_width, spread_width);
        let state = self.state.filter(|_| self.outliers == 0)?;
        Some(wall_seconds + state.at(wall_seconds).offset + mean_lag)
    }

    fn correct(&mut self, wall_seconds: f64, offset: f64, frame_seconds: f64) {
        let Some(state) = self.state.map(|state| state.at(wall_seconds)) else {
            self.state = Some(State {
                wall_seconds,
                offset,
                drift: 0.0,
                offset_variance: self.variance,
                covariance: 0.0,
                drift_variance: DRIFT_SPREAD * DRIFT_SPREAD,
            });
            return;
        };
        let surprise = offset - state.offset;
        let spread = (self.variance + state.offset_variance).sqrt();
        if surprise.abs() > (OUTLIER_SPREADS * spread).max(OUTLIER_SECONDS) {
            self.outliers += 1;
            if self.outliers >= OUTLIERS_TO_RESTART {
                // The device is the same, and so are its drift and the spread of its readings.
                self.outliers = 0;
                self.state =
                    Some(State { wall_seconds, offset, offset_variance: self.variance, covariance: 0.0, ..state });
            }
            return;
        }
        self.outliers = 0;
        // Of the square of the surprise, a part is due to what is not known of the offset yet.
        let own_part = self.variance / (self.variance + state.offset_variance);
        self.readings = (self.readings + 1.0).min(MAX_SPREAD_READINGS);
        self.variance += (surprise * surprise * own_part - self.variance) / self.readings;
        self.frame_seconds += (frame_seconds - self.frame_seconds) / self.readings;
        let clipped = surprise.clamp(-MAX_SURPRISE_SPREADS * spread, MAX_SURPRISE_SPREADS * spread);
        let cube = clipped.powi(3) / (3.0 * spread * spread);
        self.state = Some(state.corrected(cube, CUBE_VARIANCE * self.variance));
    }
}

impl State {
    /// Returns what is expected at a time.
    fn at(self, wall_seconds: f64) -> Self {
        let seconds = (wall_seconds - self.wall_seconds).max(0.0);
        Self {
            wall_seconds,
            offset: self.offset + seconds * self.drift,
            drift: self.drift,
            offset_variance: self.offset_variance
                + seconds * (2.0 * self.covariance + seconds * self.drift_variance + OFFSET_WALK),
            covariance: self.covariance + seconds * self.drift_variance,
            drift_variance: self.drift_variance + seconds * DRIFT_WALK,
        }
    }

    /// Returns what is known after a reading that differs from what was expected.
    fn corrected(self, surprise: f64, reading_variance: f64) -> Self {
        let total = self.offset_variance + reading_variance;
        let (offset_gain, drift_gain) = (self.offset_variance / total, self.covariance / total);
        Self {
            wall_seconds: self.wall_seconds,
            offset: self.offset + offset_gain * surprise,
            drift: self.drift + drift_gain * surprise,
            offset_variance: (1.0 - offset_gain) * self.offset_variance,
            covariance: (1.0 - offset_gain) * self.covariance,
            drift_variance: self.drift_variance - drift_gain * self.covariance,
        }
    }
}
