//! Time of beats: offset, tempo changes, stops and delays of a song.
//!
//! Beats enter and seconds of the song's audio leave, or the other way round. Conventions are StepMania's:
//! - Beat 0 is at −OFFSET seconds of the audio, so that a negative OFFSET is a lead-in.
//! - Before beat 0 the first tempo goes on.
//! - A stop holds the beat after the arrows of its row, a delay before them.
//! - Tempo changes and pauses are at whole rows; beats in files are rounded to them.

use super::{song_error::SongProblem, step_chart::Row};

const SECONDS_PER_MINUTE: f64 = 60.0;

/// A tempo from a row on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TempoChange {
    row: Row,
    bpm: f64,
}

impl TempoChange {
    /// Slowest tempo, below which a song would not end.
    pub(crate) const MIN_BPM: f64 = 0.001;
    /// Fastest tempo. StepMania takes higher ones as an old way to skip beats.
    pub(crate) const MAX_BPM: f64 = 9_999_999.0;

    pub(crate) fn new(row: Row, bpm: f64) -> Result<Self, SongProblem> {
        if (Self::MIN_BPM..=Self::MAX_BPM).contains(&bpm) {
            Ok(Self { row, bpm })
        } else {
            Err(SongProblem::Tempo { beat: row.beat(), bpm })
        }
    }
}

/// Which side of the arrows of its row a pause is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum PauseKind {
    /// The beat stands still before the arrows of the row.
    Delay,
    /// The beat stands still after them.
    Stop,
}

/// A time in which the beat stands still while the audio goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pause {
    kind: PauseKind,
    row: Row,
    seconds: f64,
}

impl Pause {
    pub(crate) const MAX_SECONDS: f64 = 3600.0;

    pub(crate) fn new(kind: PauseKind, row: Row, seconds: f64) -> Result<Self, SongProblem> {
        if (0.0..=Self::MAX_SECONDS).contains(&seconds) {
            Ok(Self { kind, row, seconds })
        } else {
            Err(SongProblem::Pause { kind, beat: row.beat(), seconds })
        }
    }
}

/// What happens at one row, and the tempo from there on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Segment {
    beat: f64,
    /// When the beat is reached, when its arrows are due, and when the beat goes on.
    arrival_seconds: f64,
    arrow_seconds: f64,
    departure_seconds: f64,
    seconds_per_beat: f64,
}

/// Conversion between beats and seconds of a song.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Timing {
    offset_seconds: f64,
    tempos: Vec<TempoChange>,
    pauses: Vec<Pause>,
    /// The first one is at beat 0.
    segments: Vec<Segment>,
}

impl Timing {
    /// Makes the timing of tempo changes and pauses in any order. Of two in the same place the later one counts.
    pub(crate) fn new(
        offset_seconds: f64,
        mut tempos: Vec<TempoChange>,
        mut pauses: Vec<Pause>,
    ) -> Result<Self, SongProblem> {
        if !offset_seconds.is_finite() {
            return Err(SongProblem::Offset(offset_seconds));
        }
        // Sorts are stable, and of equal ones the first in reverse is kept.
        tempos.reverse();
        tempos.sort_by_key(|tempo| tempo.row);
        tempos.dedup_by_key(|tempo| tempo.row);
        pauses.reverse();
        pauses.sort_by_key(|pause| (pause.row, pause.kind));
        pauses.dedup_by_key(|pause| (pause.row, pause.kind));
        match tempos.first() {
            Some(first) if first.row == Row(0) => {
                let segments = segments(-offset_seconds, first.bpm, &tempos, &pauses);
                Ok(Self { offset_seconds, tempos, pauses, segments })
            }
            first => Err(SongProblem::NoFirstTempo { first_beat: first.map(|tempo| tempo.row.beat()) }),
        }
    }

    /// OFFSET of StepMania in seconds: beat 0 is at its negative.
    pub(crate) fn offset_seconds(&self) -> f64 {
        self.offset_seconds
    }

    /// Beats and beats per minute of the tempo changes, in their order.
    pub(crate) fn tempos(&self) -> impl Iterator<Item = (f64, f64)> {
        self.tempos.iter().map(|tempo| (tempo.row.beat(), tempo.bpm))
    }

    /// Beats and seconds of the pauses of one kind, in their order.
    pub(crate) fn pauses(&self, kind: PauseKind) -> impl Iterator<Item = (f64, f64)> {
        self.pauses.iter().filter(move |pause| pause.kind == kind).map(|pause| (pause.row.beat(), pause.seconds))
    }

    /// Returns when the arrows of a beat are due, in seconds of the audio.
    pub(crate) fn seconds_at(&self, beat: f64) -> f64 {
        let segment = self.last_segment(|segment| segment.beat <= beat);
        let beats = beat - segment.beat;
        match beats.total_cmp(&0.0) {
            std::cmp::Ordering::Less => segment.arrival_seconds + beats * segment.seconds_per_beat,
            std::cmp::Ordering::Equal => segment.arrow_seconds,
            std::cmp::Ordering::Greater => segment.departure_seconds + beats * segment.seconds_per_beat,
        }
    }

    /// Returns the beat at a time of the audio in seconds. In a pause it is that of the pause.
    pub(crate) fn beat_at(&self, seconds: f64) -> f64 {
        let segment = self.last_segment(|segment| segment.arrival_seconds <= seconds);
        let before = (seconds - segment.arrival_seconds).min(0.0);
        let after = (seconds - segment.departure_seconds).max(0.0);
        segment.beat + (before + after) / segment.seconds_per_beat
    }

    /// Returns the tempo at a beat, in beats per minute. In a pause it is that after the pause.
    pub(crate) fn bpm_at(&self, beat: f64) -> f64 {
        SECONDS_PER_MINUTE / self.last_segment(|segment| segment.beat <= beat).seconds_per_beat
    }

    /// Returns the last segment that has begun, or the first one before it has.
    fn last_segment(&self, has_begun: impl Fn(&Segment) -> bool) -> &Segment {
        let begun = self.segments.partition_point(has_begun);
        &self.segments[begun.saturating_sub(1)]
    }
}

/// Returns the segments between all rows at which something happens. There is one at least, at beat 0.
fn segments(start_seconds: f64, first_bpm: f64, tempos: &[TempoChange], pauses: &[Pause]) -> Vec<Segment> {
    let mut rows: Vec<Row> = tempos.iter().map(|tempo| tempo.row).chain(pauses.iter().map(|pause| pause.row)).collect();
    rows.push(Row(0));
    rows.sort_unstable();
    rows.dedup();
    let (mut tempos, mut pauses) = (tempos.iter().peekable(), pauses.iter().peekable());
    let (mut beat, mut seconds) = (0.0, start_seconds);
    let mut seconds_per_beat = SECONDS_PER_MINUTE / first_bpm;
    let mut segments = Vec::with_capacity(rows.len());
    for row in rows {
        let arrival_seconds = seconds + (row.beat() - beat) * seconds_per_beat;
        let mut next_pause = |kind| pauses.next_if(|pause| pause.row == row && pause.kind == kind);
        let delay = next_pause(PauseKind::Delay).map_or(0.0, |pause| pause.seconds);
        let stop = next_pause(PauseKind::Stop).map_or(0.0, |pause| pause.seconds);
        if let Some(tempo) = tempos.next_if(|tempo| tempo.row == row) {
            seconds_per_beat = SECONDS_PER_MINUTE / tempo.bpm;
        }
        let arrow_seconds = arrival_seconds + delay;
        let departure_seconds = arrow_seconds + stop;
        (beat, seconds) = (row.beat(), departure_seconds);
        segments.push(Segment { beat, arrival_seconds, arrow_seconds, departure_seconds, seconds_per_beat });
    }
    segments
}
