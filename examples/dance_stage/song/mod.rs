//! Songs that are danced to: the arrows, the time of their beats, and the files that both are in.
//!
//! StepMania files (`.sm`, `.ssc`) enter, or notes and tempos that a composer has found in a recording; a [`Simfile`]
//! leaves, with up to three [`StepChart`]s and one [`Timing`] for all of them. No audio is read here.
//!
//! Positions are rows of 1/48 beat, times are seconds of the audio. Songs and charts cannot be invalid once made. The
//! format is that of StepMania 5.1 (`NotesLoaderSM.cpp`, `NotesLoaderSSC.cpp`, `MsdFile.cpp`; StepMania team
//! 2001–2022), less negative tempos and stops.

mod chart_rows;
mod chart_tags;
mod msd_tags;
mod simfile;
mod simfile_writer;
mod song_error;
mod step_chart;
mod timing;

pub(crate) use simfile::Simfile;
pub(crate) use song_error::{Mistake, SimfileError, SongProblem};
pub(crate) use step_chart::{Difficulty, Lane, Note, ROWS_PER_BEAT, ROWS_PER_MEASURE, Row, StepChart};
pub(crate) use timing::{Pause, PauseKind, TempoChange, Timing};
