//! Measures how late steps are judged because of screen and keys: players step to a metronome that they see
//! and, with sound, hear.

use super::{fields::NewPresses, gamepads::was_any_pressed, playback::Playback, screen::Screen};
use crate::{
    rules::{CalibrationError, LatencyCalibration},
    song::{Row, TempoChange, Timing},
};
use bevy::prelude::*;

/// Beats per minute of the metronome.
pub(crate) const METRONOME_BPM: f64 = 100.0;
const LEAD_IN_SECONDS: f64 = 1.0;

/// Steps to the metronome, on [`Screen::Calibration`].
#[derive(Resource)]
pub(crate) struct Calibration {
    timing: Timing,
    steps: LatencyCalibration,
    /// What the last round of steps has given: seconds by which they are late, negative for early.
    pub outcome: Option<Result<f64, CalibrationError>>,
}

impl Calibration {
    fn new() -> Result<Self, BevyError> {
        let timing = Timing::new(0.0, vec![TempoChange::new(Row(0), METRONOME_BPM)?], Vec::new())?;
        Ok(Self { timing, steps: LatencyCalibration::new(60.0 / METRONOME_BPM)?, outcome: None })
    }

    pub(crate) fn timing(&self) -> &Timing {
        &self.timing
    }

    pub(crate) fn steps_left(&self) -> usize {
        self.steps.steps_left()
    }
}

/// How late steps are, as it was measured, in seconds. A step counts as made this much earlier.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Latency(pub f64);

pub(super) fn start_metronome(mut commands: Commands) -> Result {
    let calibration = Calibration::new()?;
    commands.insert_resource(Playback::starting_at(-LEAD_IN_SECONDS, &calibration.timing));
    commands.insert_resource(calibration);
    Ok(())
}

/// Takes any key for a step but those that leave or show something else.
pub(super) fn step_to_metronome(
    keys: Option<Res<ButtonInput<KeyCode>>>,
    gamepads: Query<&Gamepad>,
    mut presses: NewPresses,
    playback: Res<Playback>,
    mut calibration: ResMut<Calibration>,
    mut latency: ResMut<Latency>,
) {
    const NO_STEPS: [KeyCode; 6] =
        [KeyCode::Escape, KeyCode::Enter, KeyCode::NumpadEnter, KeyCode::Tab, KeyCode::F1, KeyCode::F11];
    let steps = keys.is_some_and(|keys| keys.get_just_pressed().any(|key| !NO_STEPS.contains(key)))
        || gamepads.iter().any(was_any_pressed);
    for age in presses.take().into_iter().chain(steps.then_some(0.0)) {
        let Some(outcome) = calibration.steps.step(playback.now - age) else { continue };
        if let Ok(delay) = outcome {
            latency.0 = delay;
        }
        calibration.outcome = Some(outcome);
    }
}

pub(super) fn is_calibrating(screen: Res<State<Screen>>, calibration: Option<Res<Calibration>>) -> bool {
    *screen.get() == Screen::Calibration && calibration.is_some()
}
