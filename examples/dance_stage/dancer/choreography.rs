//! What the dancer does: moves from the arrows of a chart, as a function of the beat alone.
//!
//! A chart and a beat enter; weights and times of animations leave, which add up to a whole pose. Every foot lands on
//! the beat of its arrow: a move begins half a beat before it and ends half a beat after. Neighboring moves overlap, so
//! that no pose jumps. Equal beats always give equal poses, whatever the frame rate.

use crate::song::{Lane, ROWS_PER_BEAT, StepChart};
use std::f32::consts::PI;

/// Animation of the dancer, by its name in the glTF file. Their seconds are beats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Move {
    Idle,
    Step(Lane),
    Jump,
    Spin,
    Cheer,
    Stumble,
}

impl Move {
    pub(crate) const ALL: [Self; 9] = [
        Self::Idle,
        Self::Step(Lane::Left),
        Self::Step(Lane::Down),
        Self::Step(Lane::Up),
        Self::Step(Lane::Right),
        Self::Jump,
        Self::Spin,
        Self::Cheer,
        Self::Stumble,
    ];

    /// Name of the animation in the glTF file. The dancer faces the players like a mirror image: for an arrow to the
    /// left she steps to her right.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Step(Lane::Left) => "step_right",
            Self::Step(Lane::Down) => "step_up",
            Self::Step(Lane::Up) => "step_down",
            Self::Step(Lane::Right) => "step_left",
            Self::Jump => "jump",
            Self::Spin => "spin",
            Self::Cheer => "cheer",
            Self::Stumble => "stumble",
        }
    }

    /// Length in beats.
    pub(crate) fn beats(self) -> f64 {
        match self {
            Self::Idle | Self::Spin | Self::Cheer => 2.0,
            Self::Step(_) | Self::Jump | Self::Stumble => 1.0,
        }
    }
}

/// A move at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Motion {
    pub what: Move,
    /// Number below [`SLOTS`]. Of two motions at one moment that are the same move, each has its own.
    pub slot: usize,
    /// Beats since it began.
    pub beats: f32,
    /// Its part of the pose, 0…1.
    pub weight: f32,
}

/// Number of arrows, less than a beat apart, whose moves overlap: sixteenths.
pub(crate) const SLOTS: usize = 4;

/// Gap between arrows, in beats, in which the dancer spins, and how long after the arrow she begins.
const SPIN_GAP: f64 = 4.0;
const SPIN_DELAY: f64 = 0.5;
/// Beats in which a spin or a stumble takes over, and gives way.
const TAKEOVER: f64 = 0.2;

/// Returns all moves at a beat. Their weights add up to 1. `stumbled` is the beat of the last miss.
pub(crate) fn motions(chart: &StepChart, beat: f64, stumbled: Option<f64>) -> Vec<Motion> {
    let mut motions = steps(chart, beat);
    let stepped: f32 = motions.iter().map(|motion| motion.weight).sum();
    for motion in &mut motions {
        motion.weight /= stepped.max(1.0);
    }
    let spin = spin_since(chart, beat).map(|beats| (Move::Spin, beats));
    let stumble = stumbled.map(|at| (Move::Stumble, beat - at));
    for (what, beats) in spin.into_iter().chain(stumble) {
        take_over(&mut motions, what, beats);
    }
    let free = 1.0 - motions.iter().map(|motion| motion.weight).sum::<f32>();
    // The knees dip on the beat, in the middle of a beat of the animation.
    let beats = (beat + 0.5).rem_euclid(Move::Idle.beats()) as f32;
    motions.push(Motion { what: Move::Idle, slot: 0, beats, weight: free.max(0.0) });
    motions
}

/// Returns the moves of a dancer who cheers, without any arrows.
pub(crate) fn applause(beat: f64) -> Vec<Motion> {
    vec![Motion { what: Move::Cheer, slot: 0, beats: (beat + 0.5).rem_euclid(Move::Cheer.beats()) as f32, weight: 1.0 }]
}

/// Moves for the arrows around a beat; weights may add up to more than 1.
fn steps(chart: &StepChart, beat: f64) -> Vec<Motion> {
    let notes = chart.notes();
    let start = notes.partition_point(|note| note.beat() <= beat - 0.5);
    let near: Vec<_> = notes[start..].iter().take_while(|note| note.beat() < beat + 0.5).collect();
    near.chunk_by(|a, b| a.row == b.row)
        .map(|row| {
            let beats = (beat - row[0].beat() + 0.5) as f32;
            let what = if row.len() > 1 { Move::Jump } else { Move::Step(row[0].lane) };
            // 1 when the foot lands, 0 half a beat before and after.
            let slot = (row[0].row.0 / (ROWS_PER_BEAT / SLOTS as u32)) as usize % SLOTS;
            Motion { what, slot, beats, weight: (PI * beats).sin().powi(2) }
        })
        .collect()
}

/// Returns how long the dancer has been spinning, if there is time for it between two arrows.
fn spin_since(chart: &StepChart, beat: f64) -> Option<f64> {
    let notes = chart.notes();
    let next = notes.partition_point(|note| note.beat() <= beat);
    let last = notes[..next].last()?.last_row().beat();
    let gap = notes.get(next)?.beat() - last;
    let beats = beat - last - SPIN_DELAY;
    (gap >= SPIN_GAP && (0.0..Move::Spin.beats()).contains(&beats)).then_some(beats)
}

/// Lets a move push the others aside while it lasts.
fn take_over(motions: &mut Vec<Motion>, what: Move, beats: f64) {
    if !(0.0..what.beats()).contains(&beats) {
        return;
    }
    let weight = (beats.min(what.beats() - beats) / TAKEOVER).min(1.0) as f32;
    for motion in &mut *motions {
        motion.weight *= 1.0 - weight;
    }
    motions.push(Motion { what, slot: 0, beats: beats as f32, weight });
}
