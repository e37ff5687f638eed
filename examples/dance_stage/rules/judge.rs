//! The judge of one player: which arrow each step hits, which arrows pass without one, and which holds are held.
//!
//! A step hits the nearest arrow of its lane that has no verdict yet, if it is within the widest window. Arrows of a
//! jump are judged one by one. A hold begins when its arrow is hit; a foot that leaves it may return within the let-go
//! time, and one that leaves it for less than that before the end has held it. What is missed has no hold.
//!
//! Nothing is allocated after [`Judge::new`].

use super::windows::{Grade, HoldGrade, TimingWindows};
use crate::song::{Lane, StepChart, Timing};

/// What a step hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Verdict {
    /// Index into [`StepChart::notes`].
    pub note: usize,
    pub lane: Lane,
    pub grade: Grade,
    /// How late the step was; negative for early.
    pub error_seconds: f64,
}

/// What happened without a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct JudgeEvent {
    /// When it was certain, in seconds of the song.
    pub seconds: f64,
    /// Index into [`StepChart::notes`].
    pub note: usize,
    pub lane: Lane,
    pub kind: JudgeEventKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum JudgeEventKind {
    Missed,
    HoldEnded(HoldGrade),
}

/// Judge of one player's steps on one chart.
#[derive(Debug)]
pub(crate) struct Judge {
    windows: TimingWindows,
    lanes: [LaneArrows; Lane::COUNT],
    /// By index of the note. `None` as long as it has no verdict.
    grades: Vec<Option<Grade>>,
    unjudged: usize,
    /// Events since the last call of `advance`, and those that it returned.
    new_events: Vec<JudgeEvent>,
    events: Vec<JudgeEvent>,
}

#[derive(Debug, Default)]
struct LaneArrows {
    arrows: Vec<Arrow>,
    /// Number of arrows at the start of the list that all have a verdict.
    passed: usize,
    hold: Option<Hold>,
}

#[derive(Clone, Copy, Debug)]
struct Arrow {
    note: usize,
    seconds: f64,
    end_seconds: Option<f64>,
}

/// Hold whose arrow was hit.
#[derive(Clone, Copy, Debug)]
struct Hold {
    note: usize,
    start_seconds: f64,
    end_seconds: f64,
    released_seconds: Option<f64>,
}

impl Judge {
    pub(crate) fn new(chart: &StepChart, timing: &Timing, windows: TimingWindows) -> Self {
        let mut lanes = <[LaneArrows; Lane::COUNT]>::default();
        for (i, note) in chart.notes().iter().enumerate() {
            let end_seconds = note.tail().map(|tail| timing.seconds_at(tail.beat()));
            let arrow = Arrow { note: i, seconds: timing.seconds_at(note.beat()), end_seconds };
            lanes[note.lane.index()].arrows.push(arrow);
        }
        let count = chart.notes().len();
        // Each note has at most one event: a miss, or the end of its hold.
        let events = || Vec::with_capacity(count);
        Self { windows, lanes, grades: vec![None; count], unjudged: count, new_events: events(), events: events() }
    }

    /// Judges a foot that steps on a panel. `None` if there is no arrow to hit.
    pub(crate) fn press(&mut self, lane: Lane, song_seconds: f64) -> Option<Verdict> {
        self.lanes[lane.index()].step_back_on_hold(song_seconds, self.windows.let_go_seconds());
        let arrow = self.nearest(lane, song_seconds)?;
        let error_seconds = song_seconds - arrow.seconds;
        let grade = self.windows.grade(error_seconds)?;
        self.grades[arrow.note] = Some(grade);
        self.unjudged -= 1;
        if let Some(end_seconds) = arrow.end_seconds {
            let hold = Hold { note: arrow.note, start_seconds: arrow.seconds, end_seconds, released_seconds: None };
            // An arrow can be hit a little before the hold in front of it has ended: that one counts as held.
            if let Some(earlier) = self.lanes[lane.index()].hold.replace(hold) {
                let kind = JudgeEventKind::HoldEnded(HoldGrade::Held);
                self.new_events.push(JudgeEvent { seconds: song_seconds, note: earlier.note, lane, kind });
            }
        }
        Some(Verdict { note: arrow.note, lane, grade, error_seconds })
    }

    /// Takes note of a foot that leaves a panel.
    pub(crate) fn release(&mut self, lane: Lane, song_seconds: f64) {
        if let Some(hold) = &mut self.lanes[lane.index()].hold {
            hold.released_seconds.get_or_insert(song_seconds);
        }
    }

    /// Returns what has happened without a step since the last call, in the order of time.
    pub(crate) fn advance(&mut self, song_seconds: f64) -> &[JudgeEvent] {
        for lane in Lane::ALL {
            self.end_hold(lane, song_seconds);
            self.miss_arrows(lane, song_seconds);
        }
        std::mem::swap(&mut self.events, &mut self.new_events);
        self.new_events.clear();
        self.events.sort_unstable_by(|a, b| a.seconds.total_cmp(&b.seconds).then(a.note.cmp(&b.note)));
        &self.events
    }

    /// Returns the grade of a note, by its index in the chart. `None` as long as it has none.
    pub(crate) fn grade_of(&self, note: usize) -> Option<Grade> {
        self.grades.get(note).copied().flatten()
    }

    /// Returns the note whose hold goes on in a lane, and whether a foot is on it.
    pub(crate) fn hold_in(&self, lane: Lane) -> Option<(usize, bool)> {
        self.lanes[lane.index()].hold.map(|hold| (hold.note, hold.released_seconds.is_none()))
    }

    /// Whether all arrows have a verdict and all holds have ended.
    pub(crate) fn is_finished(&self) -> bool {
        self.unjudged == 0 && self.lanes.iter().all(|lane| lane.hold.is_none())
    }

    /// Returns the arrow without a verdict that is nearest to a time, the earlier one of two.
    fn nearest(&self, lane: Lane, song_seconds: f64) -> Option<Arrow> {
        let LaneArrows { arrows, passed, .. } = &self.lanes[lane.index()];
        let widest = self.windows.widest_seconds();
        let distance = |arrow: &Arrow| (song_seconds - arrow.seconds).abs();
        let in_reach = arrows[*passed..].iter().take_while(|arrow| arrow.seconds <= song_seconds + widest);
        let unjudged = in_reach.filter(|arrow| self.grades[arrow.note].is_none());
        unjudged.min_by(|a, b| distance(a).total_cmp(&distance(b))).copied()
    }

    fn end_hold(&mut self, lane: Lane, song_seconds: f64) {
        let hold = &mut self.lanes[lane.index()].hold;
        let Some(Hold { note, end_seconds, .. }) = *hold else { return };
        let lost_seconds = hold.and_then(|hold| hold.lost_seconds(self.windows.let_go_seconds()));
        let (seconds, grade) = match lost_seconds {
            Some(lost) if lost < end_seconds => (lost, HoldGrade::LetGo),
            _ => (end_seconds, HoldGrade::Held),
        };
        if song_seconds >= seconds {
            *hold = None;
            self.new_events.push(JudgeEvent { seconds, note, lane, kind: JudgeEventKind::HoldEnded(grade) });
        }
    }

    fn miss_arrows(&mut self, lane: Lane, song_seconds: f64) {
        let widest = self.windows.widest_seconds();
        let LaneArrows { arrows, passed, .. } = &mut self.lanes[lane.index()];
        while let Some(arrow) = arrows.get(*passed) {
            let grade = &mut self.grades[arrow.note];
            if grade.is_none() {
                let seconds = arrow.seconds + widest;
                if song_seconds <= seconds || song_seconds.is_nan() {
                    break;
                }
                *grade = Some(Grade::Miss);
                self.unjudged -= 1;
                self.new_events.push(JudgeEvent { seconds, note: arrow.note, lane, kind: JudgeEventKind::Missed });
            }
            *passed += 1;
        }
    }
}

impl LaneArrows {
    fn step_back_on_hold(&mut self, song_seconds: f64, let_go_seconds: f64) {
        if let Some(hold) = &mut self.hold
            && hold.lost_seconds(let_go_seconds).is_some_and(|lost| song_seconds < lost)
        {
            hold.released_seconds = None;
        }
    }
}

impl Hold {
    /// Returns when the hold is lost, if no foot steps back on it. Before its start none has to be on it.
    fn lost_seconds(&self, let_go_seconds: f64) -> Option<f64> {
        self.released_seconds.map(|released| released.max(self.start_seconds) + let_go_seconds)
    }
}
