//! Errors in songs: what is wrong, where, and what to write instead.

use super::{
    step_chart::{Lane, ROWS_PER_MEASURE},
    timing::{Pause, PauseKind, TempoChange},
};
use std::path::PathBuf;

/// Error in a StepMania file.
#[derive(thiserror::Error, Debug)]
pub(crate) enum SimfileError {
    #[error("cannot read the song {}: {source}; give the path of a StepMania file (.sm or .ssc)", .file.display())]
    Unreadable { file: PathBuf, source: std::io::Error },
    #[error("cannot read the song {}, line {line}: {problem}", .file.display())]
    Mistake { file: PathBuf, line: usize, problem: SongProblem },
}

/// What is wrong with a song.
#[derive(thiserror::Error, Clone, Debug, PartialEq)]
pub(crate) enum SongProblem {
    #[error("#{tag} is not closed before the next tag or the end of the file; write a ; after its last value")]
    Unclosed { tag: String },
    #[error("#{tag} has {found:?} where a number is expected; write one such as -0.125 or 120")]
    Number { tag: String, found: String },
    #[error("#{tag} has {found:?}; write BEAT=VALUE, with commas between several")]
    Pair { tag: String, found: String },
    #[error("#{tag} has something at beat {beat}; write beats from 0 to 89478485")]
    Beat { tag: String, beat: f64 },
    #[error("#OFFSET is {0}; write the seconds from beat 0 to the start of the music")]
    Offset(f64),
    #[error(
        "#BPMS has a tempo of {bpm} at beat {beat}; write {} to {}; old files skip beats by negative or very high \
         tempos, which this game does not play",
        TempoChange::MIN_BPM,
        TempoChange::MAX_BPM
    )]
    Tempo { beat: f64, bpm: f64 },
    #[error("#BPMS has {}; add the tempo at beat 0, such as 0=120", match first_beat {
        Some(beat) => format!("its first tempo at beat {beat}"),
        None => "no tempo".to_owned(),
    })]
    NoFirstTempo { first_beat: Option<f64> },
    #[error(
        "{} has {seconds} seconds at beat {beat}; write 0 to {}; old files skip beats by negative ones, which this \
         game does not play",
        match kind { PauseKind::Stop => "#STOPS", PauseKind::Delay => "#DELAYS" },
        Pause::MAX_SECONDS
    )]
    Pause { kind: PauseKind, beat: f64, seconds: f64 },
    #[error(
        "#NOTES has {found} parts; write six with colons between: dance-single, author, difficulty, meter, radar \
         values, rows"
    )]
    ChartParts { found: usize },
    #[error("the chart has no rows; write them in #NOTES after its other tags")]
    NoRows,
    #[error("#WARPS skip beats, which this game does not play; leave them out")]
    Warps,
    #[error("the difficulty is {found:?}; write Beginner, Easy, Medium, Hard or Challenge")]
    Difficulty { found: String },
    #[error("the meter is {found:?}; write a whole number from 1")]
    Meter { found: String },
    #[error("the row {found:?} has {} columns; dance-single has 4, one for each arrow", .found.chars().count())]
    Columns { found: String },
    #[error(
        "the row {row:?} has {found:?}; write 0 (nothing), 1 (step), 2 (hold), 3 (its end), 4 (roll) or M (mine); \
         other kinds of notes are not played"
    )]
    NoteKind { row: String, found: char },
    #[error(
        "the measure has {found} rows; {ROWS_PER_MEASURE} has to be divisible by their number, so write 4, 8, 12, 16, \
         24, 32, 48, 64, 96 or 192"
    )]
    MeasureRows { found: usize },
    #[error("the chart has too many measures; write {} at most", u32::MAX / ROWS_PER_MEASURE)]
    TooLong,
    #[error("a hold of the {lane:?} arrow has no end; write 3 in its column in a later row")]
    HoldWithoutEnd { lane: Lane },
    #[error("the end of a hold of the {lane:?} arrow has no beginning; write 2 in its column in an earlier row")]
    EndWithoutHold { lane: Lane },
    #[error("the {lane:?} arrow has a note within a hold; end the hold with 3 in an earlier row, or write 0")]
    WithinHold { lane: Lane },
    #[error("the {lane:?} arrow has two notes at beat {beat}, or one within a hold; leave one of them")]
    Overlap { beat: f64, lane: Lane },
    #[error("the hold of the {lane:?} arrow at beat {beat} has no length, or does not end within the song")]
    HoldLength { beat: f64, lane: Lane },
    #[error("the file has no chart for dance-single that could be played; add one")]
    NoChart,
}

/// A problem and the line of the file where it is, counted from 1.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mistake {
    pub line: usize,
    pub problem: SongProblem,
}

impl SongProblem {
    pub(super) fn at(self, line: usize) -> Mistake {
        Mistake { line, problem: self }
    }
}
