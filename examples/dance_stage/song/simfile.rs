//! StepMania files (`.sm` and `.ssc`): titles, timing and charts of a song.
//!
//! Charts of four lanes (`dance-single`) are read; those of other games, edits, and charts with a timing of their own
//! (in `.ssc`) are skipped. Mines are left out and counted. Unknown tags are ignored.

use super::{
    chart_tags::{CHART_START, read_charts},
    msd_tags::{Tag, read_tags},
    song_error::{Mistake, SimfileError, SongProblem},
    step_chart::{Difficulty, Row, StepChart},
    timing::{Pause, PauseKind, TempoChange, Timing},
};
use std::path::Path;

/// A song as a StepMania file describes it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Simfile {
    pub title: String,
    pub artist: String,
    /// Who made the charts.
    pub credit: String,
    /// Path of the audio file, relative to the folder of the StepMania file. Empty if there is none.
    pub music: String,
    pub timing: Timing,
    /// Not empty, except if the game has made the song and has not added any yet.
    pub charts: Vec<StepChart>,
    /// Number of mines that were left out.
    pub mines: usize,
}

impl Simfile {
    /// Reads a file. What is not UTF-8 in it, such as titles of old files, is replaced.
    pub(crate) fn open(path: &Path) -> Result<Self, SimfileError> {
        let bytes = std::fs::read(path).map_err(|source| SimfileError::Unreadable { file: path.to_owned(), source })?;
        Self::parse(&String::from_utf8_lossy(&bytes)).map_err(|mistake| {
            let Mistake { line, problem } = mistake;
            SimfileError::Mistake { file: path.to_owned(), line, problem }
        })
    }

    /// Reads the text of a file.
    pub(crate) fn parse(text: &str) -> Result<Self, Mistake> {
        let tags = read_tags(text)?;
        let of_song = tags.iter().position(|tag| tag.name == CHART_START).map_or(&tags[..], |start| &tags[..start]);
        // As in StepMania, the last of several counts.
        let find = |names: &[&str]| of_song.iter().rfind(|tag| names.contains(&tag.name.as_str()));
        let text_of = |name| find(&[name]).map(|tag| tag.text(0).to_owned()).unwrap_or_default();
        let last_line = text.lines().count().max(1);

        let offset_seconds = match find(&["OFFSET"]) {
            Some(tag) if !tag.text(0).is_empty() => number(tag, tag.text(0)).map_err(|problem| problem.at(tag.line))?,
            _ => 0.0,
        };
        let bpms = find(&["BPMS"]);
        let tempos = bpms.map_or(Ok(Vec::new()), |tag| read_pairs(tag, TempoChange::new))?;
        let mut pauses = Vec::new();
        for (kind, names) in [(PauseKind::Stop, &["STOPS", "FREEZES"][..]), (PauseKind::Delay, &["DELAYS"])] {
            if let Some(tag) = find(names) {
                pauses.extend(read_pairs(tag, |row, seconds| Pause::new(kind, row, seconds))?);
            }
        }
        let timing = Timing::new(offset_seconds, tempos, pauses).map_err(|problem| {
            let tag = if matches!(problem, SongProblem::Offset(_)) { find(&["OFFSET"]) } else { bpms };
            problem.at(tag.map_or(last_line, |tag| tag.line))
        })?;

        if let Some(warps) = find(&["WARPS"]).filter(|tag| !tag.text(0).is_empty()) {
            return Err(SongProblem::Warps.at(warps.line));
        }
        let (charts, mines) = read_charts(&tags)?;
        if charts.is_empty() {
            return Err(SongProblem::NoChart.at(last_line));
        }
        let [title, artist, credit, music] = ["TITLE", "ARTIST", "CREDIT", "MUSIC"].map(text_of);
        Ok(Self { title, artist, credit, music, timing, charts, mines })
    }

    /// Returns the chart that is nearest to a difficulty, the easier one of two. Of several of one difficulty it is the
    /// one nearest to medium: that called Easy before Beginner, and Hard before Challenge. `None` without charts.
    pub(crate) fn chart(&self, difficulty: Difficulty) -> Option<&StepChart> {
        self.charts.iter().min_by_key(|chart| {
            let from_medium = match chart.difficulty {
                Difficulty::Easy => u32::MAX - chart.meter,
                Difficulty::Medium | Difficulty::Hard => chart.meter,
            };
            (chart.difficulty.distance(difficulty), chart.difficulty, from_medium)
        })
    }
}

/// Reads the list `beat=value,beat=value` of a tag.
fn read_pairs<T>(tag: &Tag, make: impl Fn(Row, f64) -> Result<T, SongProblem>) -> Result<Vec<T>, Mistake> {
    let mut pairs = Vec::new();
    for value in tag.values.iter().take(1) {
        for (line, text) in (value.line..).zip(value.text.split('\n')) {
            for pair in text.split(',').map(str::trim).filter(|pair| !pair.is_empty()) {
                let made = read_pair(tag, pair).and_then(|(row, number)| make(row, number));
                pairs.push(made.map_err(|problem| problem.at(line))?);
            }
        }
    }
    Ok(pairs)
}

fn read_pair(tag: &Tag, pair: &str) -> Result<(Row, f64), SongProblem> {
    let (beat, value) =
        pair.split_once('=').ok_or_else(|| SongProblem::Pair { tag: tag.name.clone(), found: pair.to_owned() })?;
    let beat = number(tag, beat)?;
    let row = Row::nearest(beat).ok_or_else(|| SongProblem::Beat { tag: tag.name.clone(), beat })?;
    Ok((row, number(tag, value)?))
}

fn number(tag: &Tag, text: &str) -> Result<f64, SongProblem> {
    let not_a_number = || SongProblem::Number { tag: tag.name.clone(), found: text.trim().to_owned() };
    text.trim().parse().map_err(|_| not_a_number())
}
