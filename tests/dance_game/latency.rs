//! Calibration of the delay of sound and input.

use crate::random::Random;
use crate::rules::{CalibrationError, LatencyCalibration, click_track};

const BEAT: f64 = 0.5;

/// Returns what steps to a metronome come to, and that it is known with the last one.
fn calibrate(error: impl FnMut(usize) -> f64) -> Result<f64, CalibrationError> {
    let mut calibration = LatencyCalibration::new(BEAT).expect("the beat has a length");
    calibrate_with(&mut calibration, error)
}

fn calibrate_with(
    calibration: &mut LatencyCalibration,
    mut error: impl FnMut(usize) -> f64,
) -> Result<f64, CalibrationError> {
    for i in 0..LatencyCalibration::STEPS - 1 {
        assert_eq!(calibration.step(BEAT * i as f64 + error(i)), None);
    }
    assert_eq!(calibration.steps_left(), 1);
    let last = LatencyCalibration::STEPS - 1;
    calibration.step(BEAT * last as f64 + error(last)).expect("this is the last step")
}

#[track_caller]
fn assert_delay(found: Result<f64, CalibrationError>, delay: f64, tolerance: f64) {
    assert!(found.is_ok_and(|found| (found - delay).abs() <= tolerance), "{found:?} instead of {delay}");
}

#[test]
fn the_delay_is_the_mean_error() {
    assert_delay(calibrate(|i| 0.05 + if i % 2 == 0 { 0.01 } else { -0.01 }), 0.05, 1e-9);
    assert_delay(calibrate(|_| -0.08), -0.08, 1e-9);
}

#[test]
fn steps_of_a_person_give_the_delay_to_a_few_milliseconds() {
    for seed in 0..50 {
        let mut random = Random::new(seed);
        // Four standard errors of the mean of 24 steps.
        assert_delay(calibrate(|_| 0.07 + 0.015 * random.normal()), 0.07, 4.0 * 0.015 / 24_f64.sqrt());
    }
}

#[test]
fn a_few_stray_steps_are_left_out() {
    let stray = |i: usize| [0, 7, 15].contains(&i);
    assert_delay(calibrate(|i| if stray(i) { -0.15 } else { 0.04 + 0.001 * (i % 3) as f64 }), 0.041, 1e-3);
}

#[test]
fn uneven_steps_give_no_delay() {
    let found = calibrate(|i| 0.06 * ((i % 5) as f64 - 2.0));
    assert!(matches!(found, Err(CalibrationError::Uneven { spread_seconds }) if spread_seconds > 0.06), "{found:?}");
    // More stray steps than a few are no outliers.
    let found = calibrate(|i| if i < 6 { 0.2 } else { 0.0 });
    assert!(matches!(found, Err(CalibrationError::Uneven { .. })), "{found:?}");
}

#[test]
fn delays_about_half_a_beat_are_not_torn_apart() {
    assert_delay(calibrate(|i| 0.245 + if i % 2 == 0 { 0.01 } else { -0.01 }), 0.245, 1e-9);
}

#[test]
fn a_calibration_begins_anew_after_its_last_step() {
    let mut calibration = LatencyCalibration::new(BEAT).expect("the beat has a length");
    for delay in [0.1, 0.02] {
        assert_eq!(calibration.steps_left(), LatencyCalibration::STEPS);
        assert_delay(calibrate_with(&mut calibration, |_| delay), delay, 1e-9);
    }
    assert_eq!(calibration.step(f64::NAN), None);
    assert_eq!(calibration.steps_left(), LatencyCalibration::STEPS);
}

#[test]
fn a_metronome_needs_a_beat() {
    for beat in [0.0, -1.0, f64::INFINITY] {
        let found = LatencyCalibration::new(beat).err();
        assert_eq!(found, Some(CalibrationError::Beat(beat)));
    }
    assert!(LatencyCalibration::new(f64::NAN).is_err());
}

#[test]
fn the_metronome_clicks_on_its_beats_and_is_still_between_them() {
    let wav = click_track(0.6, 3.0);
    let mut reader = hound::WavReader::new(&wav[..]).expect("a WAV file");
    let rate = f64::from(reader.spec().sample_rate);
    let samples: Vec<i16> = reader.samples().collect::<Result<_, _>>().expect("complete");
    assert_eq!(samples.len() as f64, 3.0 * rate);
    let loudest = |from: f64, to: f64| {
        samples[(from * rate) as usize..(to * rate) as usize].iter().map(|sample| sample.unsigned_abs()).max()
    };
    for beat in 0..5 {
        let beat = 0.6 * f64::from(beat);
        assert!(loudest(beat, beat + 0.002) > Some(10_000), "no click at {beat}");
        assert!(loudest(beat + 0.1, beat + 0.59) < Some(10), "noise after {beat}");
    }
}
