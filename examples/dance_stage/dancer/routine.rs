//! What the dancer does without a song.

use super::choreography::{Motion, motions};
use crate::song::{Difficulty, Lane, Note, ROWS_PER_BEAT, Row, StepChart};
use bevy::prelude::*;

/// Lanes of the routine, beat by beat; two for a jump, none for a rest. Long enough a rest for a spin.
const BEATS: [&[Lane]; 32] = {
    use Lane::{Down, Left, Right, Up};
    [
        &[Left],
        &[Right],
        &[Left],
        &[Right],
        &[Up],
        &[Down],
        &[Up],
        &[Down],
        &[Left],
        &[Up],
        &[Right],
        &[Down],
        &[Left],
        &[Up],
        &[Right],
        &[Left, Right],
        &[],
        &[],
        &[],
        &[],
        &[Right],
        &[Left],
        &[Right],
        &[Left],
        &[Down],
        &[Up],
        &[Left],
        &[Right],
        &[Down, Up],
        &[Left],
        &[Right],
        &[Left, Right],
    ]
};

/// A chart that is danced over and over.
#[derive(Resource)]
pub(super) struct Routine(Option<StepChart>);

impl Default for Routine {
    fn default() -> Self {
        // Twice, so that the first beat follows the last one.
        let rows = (0..).map(|beat| Row(beat * ROWS_PER_BEAT)).zip(BEATS.iter().chain(&BEATS));
        let notes = rows.flat_map(|(row, lanes)| lanes.iter().map(move |lane| Note::tap(row, *lane)));
        Self(StepChart::new(Difficulty::Easy, 1, notes.collect()).ok())
    }
}

impl Routine {
    pub(super) fn motions(&self, beat: f64) -> Vec<Motion> {
        // In the first round nothing is before the first beat, later the last one is.
        let length = BEATS.len() as f64;
        let beat = if beat < 1.5 * length { beat } else { 0.5 * length + (beat - 0.5 * length).rem_euclid(length) };
        self.0.as_ref().map_or_else(Vec::new, |chart| motions(chart, beat, None))
    }
}
