//! Charts for any song: finds the beat of a recording and sets arrows on it.
//!
//! An OGG Vorbis or WAV file enters, and a [`Simfile`] leaves, with charts of three difficulties. The stages, one file
//! each:
//!
//! | stage | from | to |
//! |---|---|---|
//! | `decode` (`_ogg`, `_wav`) | file | mono samples |
//! | `spectrum` | samples | magnitudes of bands, every 5 ms |
//! | `onsets` | spectra | onset strength, onsets |
//! | `tempo` | onset strength | period of the beat, every second |
//! | `beats` | onset strength, periods | beats |
//! | `tempo_fit` | beats, onsets | a few constant tempos |
//! | `clarity` | tempos, onsets | whether there is a beat at all |
//! | `measures` | tempos, spectra | which beat is the first of four |
//! | `slots` | onsets, tempos | what sounds at each quarter beat, which phrases repeat |
//! | `arrange` | slots | when to step |
//! | `footwork` | steps | in which lane |
//!
//! Times are seconds from the first sample. The same file and seed have the same charts on every machine. Limits: music
//! without a steady pulse has no charts, measures have four beats, and a tempo may come out doubled or halved, which
//! leaves the arrows on beats or half beats.

mod arrange;
mod beats;
mod clarity;
mod compose_error;
mod decode;
mod decode_ogg;
mod decode_wav;
mod footwork;
mod levels;
mod measures;
pub(crate) mod onsets;
mod slots;
pub(crate) mod spectrum;
mod tempo;
mod tempo_fit;
mod tempo_map;

pub(crate) use compose_error::ComposeError;
pub(crate) use decode::{Sound, decode};

use crate::song::{Difficulty, Note, ROWS_PER_BEAT, Row, Simfile, StepChart, TempoChange, Timing};
use arrange::{Step, arrange};
use clarity::{MIN_CLARITY, clarity};
use levels::Level;
use onsets::{Onset, OnsetStrength, onset_seconds};
use slots::{SLOTS_PER_BEAT, Slots};
use spectrum::Spectra;
use std::path::Path;
use tempo::Periods;
use tempo_map::TempoMap;

/// Timing and charts of a song.
#[derive(Debug)]
pub(crate) struct Composition {
    pub timing: Timing,
    /// One for each difficulty, from easy to hard.
    pub charts: Vec<StepChart>,
}

/// Sets arrows to an audio file. The title is the name of the file.
pub(crate) fn compose_file(file: &Path, seed: u64) -> Result<Simfile, ComposeError> {
    let Composition { timing, charts } = compose(&decode(file)?, seed)?;
    let text =
        |part: Option<&std::ffi::OsStr>| part.map(|part| part.to_string_lossy().into_owned()).unwrap_or_default();
    Ok(Simfile {
        title: text(file.file_stem()).replace('_', " "),
        artist: String::new(),
        credit: "arrows set by the composer of dance_stage".to_owned(),
        music: text(file.file_name()),
        timing,
        charts,
        mines: 0,
    })
}

/// Sets arrows to sound.
pub(crate) fn compose(sound: &Sound, seed: u64) -> Result<Composition, ComposeError> {
    let spectra = Spectra::of(sound);
    let strength = OnsetStrength::of(&spectra);
    let onsets = strength.onsets(&spectra);
    let no_beat = |reason| ComposeError::NoBeat { seconds: sound.seconds(), reason };
    let map = find_beats(&spectra, &strength, &onsets).ok_or_else(|| no_beat("too few sounds begin"))?;
    if clarity(&map, &onsets) < MIN_CLARITY {
        return Err(no_beat("sounds begin at any time, not on a beat"));
    }
    let song = Slots::of(&map, &onsets, &spectra);
    let charts = Difficulty::ALL.map(|difficulty| chart(&song, difficulty, seed));
    let charts = charts.into_iter().collect::<Result<Vec<_>, _>>()?;
    if charts.iter().any(|chart| chart.notes().is_empty()) {
        return Err(no_beat("no sound is on the beat"));
    }
    Ok(Composition { timing: timing(&map)?, charts })
}

/// Tempos of the song, with beat 0 at the beginning of a measure. `None` if there is no beat.
fn find_beats(spectra: &Spectra, strength: &OnsetStrength, onsets: &[Onset]) -> Option<TempoMap> {
    let periods = Periods::of(strength, spectra.hop_seconds)?;
    let beats = beats::beat_frames(strength, spectra, &periods);
    let beats: Vec<f64> = beats.into_iter().map(|frame| onset_seconds(spectra, frame as f64)).collect();
    let map = tempo_fit::fit_tempos(&beats, onsets)?;
    Some(measures::count_from_downbeat(&map, onsets, strength, spectra))
}

fn timing(map: &TempoMap) -> Result<Timing, ComposeError> {
    let changes = map.tempos().enumerate().map(|(i, (beat, bpm))| {
        // The first tempo also holds before its first node.
        let row = if i == 0 { Row(0) } else { Row::nearest(beat).unwrap_or(Row(0)) };
        TempoChange::new(row, bpm)
    });
    Ok(Timing::new(-map.seconds_at(0.0), changes.collect::<Result<_, _>>()?, Vec::new())?)
}

fn chart(song: &Slots, difficulty: Difficulty, seed: u64) -> Result<StepChart, ComposeError> {
    let level = Level::of(difficulty);
    let steps = arrange(song, &level);
    let lanes = footwork::lanes(&steps, song, &level, seed);
    let mut notes = Vec::with_capacity(steps.len());
    for (step, (lane, other)) in steps.iter().zip(lanes) {
        let rows = |slots: usize| slots as u32 * ROWS_PER_BEAT / SLOTS_PER_BEAT as u32;
        let row = Row(rows(step.slot));
        for lane in [Some(lane), other].into_iter().flatten() {
            notes.push(Note { row, lane, length_rows: step.hold.map(rows) });
        }
    }
    Ok(StepChart::new(difficulty, meter(&steps, song, &level), notes)?)
}

/// Meter of a chart, by its arrows per second.
fn meter(steps: &[Step], song: &Slots, level: &Level) -> u32 {
    const BUSY: f64 = 5.0;
    let seconds = |step: &Step| song.slots[step.slot].seconds;
    let (Some(first), Some(last)) = (steps.first(), steps.last()) else { return level.meters.start };
    let per_second = steps.len() as f64 / (seconds(last) - seconds(first)).max(1.0);
    let range = f64::from(level.meters.end - 1 - level.meters.start);
    level.meters.start + (range * (per_second / BUSY).min(1.0)).round() as u32
}
