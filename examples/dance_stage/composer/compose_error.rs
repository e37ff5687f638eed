//! What can go wrong between an audio file and its charts.

use crate::song::SongProblem;
use std::path::PathBuf;

/// Reason why a file has no charts.
#[derive(Debug, thiserror::Error)]
pub(crate) enum ComposeError {
    #[error("cannot open {}: {source}; check the path and the permission to read it", file.display())]
    Open { file: PathBuf, source: std::io::Error },
    #[error(
        "{} is neither OGG Vorbis nor PCM WAV ({reason}); convert it, say with `ffmpeg -i FILE song.ogg`",
        file.display()
    )]
    Format { file: PathBuf, reason: String },
    #[error("{} has no sound in it; choose a file with an audio track", file.display())]
    NoSound { file: PathBuf },
    #[error("{} is damaged after {seconds:.1} s ({reason}); encode it again from its source", file.display())]
    Damaged { file: PathBuf, seconds: f64, reason: String },
    #[error(
        "{} has {rate} samples a second and arrows need {MIN_RATE} to {MAX_RATE}; convert it, say with \
         `ffmpeg -i FILE -ar 44100 song.ogg`",
        file.display()
    )]
    Rate { file: PathBuf, rate: u32 },
    #[error("{} is longer than {MAX_MINUTES} minutes; cut a song out of it", file.display())]
    TooLong { file: PathBuf },
    #[error("no beat can be found in {seconds:.1} s of sound: {reason}; choose music with a steady pulse")]
    NoBeat { seconds: f64, reason: &'static str },
    #[error("the composer has made a song that is no song: {0}; report this as an error of the game")]
    Song(#[from] SongProblem),
}

/// Lowest sample rate in hertz: below, cymbals are lost.
pub(crate) const MIN_RATE: u32 = 8_000;
/// Highest sample rate in hertz.
pub(crate) const MAX_RATE: u32 = 192_000;
/// Longest song in minutes, so that a broken header cannot fill the memory.
pub(crate) const MAX_MINUTES: u32 = 30;
