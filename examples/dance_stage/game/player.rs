//! Players, their steps, and what these are worth.

use super::playback::Playback;
use crate::{
    rules::{Grade, HoldGrade, Judge, JudgeEventKind, Step, StepKind, Tally, TimingWindows},
    song::{Lane, Note, StepChart, Timing},
};
use bevy::prelude::*;

/// Someone who dances a chart.
#[derive(Component)]
#[require(Steps)]
pub(crate) struct Player {
    /// 0 for the first player.
    pub number: usize,
    pub chart: StepChart,
    /// Length of the longest hold of the chart, 0 without holds.
    pub longest_hold_beats: f64,
    windows: TimingWindows,
    pub judge: Judge,
    pub tally: Tally,
    /// Panels with a foot on them.
    pub stands_on: [bool; Lane::COUNT],
    /// When an arrow was missed last, in seconds of the song.
    pub last_miss: Option<f64>,
    /// The newest verdict.
    pub latest: Option<Hit>,
    /// The newest hit in each lane.
    pub hits: [Option<Hit>; Lane::COUNT],
}

/// A verdict, and when it was given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    pub grade: Grade,
    /// Time of the song.
    pub seconds: f64,
}

impl Player {
    pub(crate) fn new(number: usize, chart: StepChart, timing: &Timing, windows: TimingWindows) -> Self {
        let hold = |note: &Note| note.tail().map(|tail| tail.beat() - note.beat());
        Self {
            number,
            longest_hold_beats: chart.notes().iter().filter_map(hold).fold(0.0, f64::max),
            judge: Judge::new(&chart, timing, windows),
            tally: Tally::new(&chart),
            chart,
            windows,
            stands_on: [false; Lane::COUNT],
            last_miss: None,
            latest: None,
            hits: [None; Lane::COUNT],
        }
    }

    /// Number of arrows that are overdue and have no verdict: none, unless the game has a fault.
    pub(crate) fn dropped(&self, timing: &Timing, now: f64) -> usize {
        let is_overdue = |beat: f64| timing.seconds_at(beat) + self.windows.widest_seconds() < now;
        let notes = self.chart.notes().iter().enumerate();
        notes.filter(|(i, note)| is_overdue(note.beat()) && self.judge.grade_of(*i).is_none()).count()
    }

    fn take(&mut self, step: Step) {
        self.pass_until(step.seconds);
        let is_press = step.kind == StepKind::Press;
        self.stands_on[step.lane.index()] = is_press;
        if !is_press {
            self.judge.release(step.lane, step.seconds);
        } else if let Some(verdict) = self.judge.press(step.lane, step.seconds) {
            self.tally.count_step(&verdict);
            let hit = Hit { grade: verdict.grade, seconds: step.seconds };
            self.latest = Some(hit);
            self.hits[step.lane.index()] = Some(hit);
        }
    }

    /// Counts what was missed and held until a time.
    fn pass_until(&mut self, seconds: f64) {
        for event in self.judge.advance(seconds) {
            self.tally.count_event(event);
            if matches!(event.kind, JudgeEventKind::Missed | JudgeEventKind::HoldEnded(HoldGrade::LetGo)) {
                self.last_miss = Some(event.seconds);
                self.latest = Some(Hit { grade: Grade::Miss, seconds: event.seconds });
            }
        }
    }
}

/// Steps of a player that are not judged yet, in the order of their times.
#[derive(Component, Default)]
pub(crate) struct Steps(pub Vec<Step>);

pub(super) fn judge_steps(playback: Res<Playback>, mut players: Query<(&mut Player, &mut Steps)>) {
    for (mut player, mut steps) in &mut players {
        for step in steps.0.drain(..) {
            player.take(step);
        }
        player.pass_until(playback.now);
    }
}

pub(super) fn despawn_players(mut commands: Commands, players: Query<Entity, With<Player>>) {
    for player in &players {
        commands.entity(player).despawn();
    }
}
