//! Step charts: which arrows a dancer steps on, and when.
//!
//! Positions are whole rows, 48 to a beat and 192 to a measure, as in StepMania: every rhythm down to a 64th triplet is
//! exact, and two arrows of a jump are in the same row, not merely close.

use super::song_error::SongProblem;

pub(crate) const ROWS_PER_BEAT: u32 = 48;
pub(crate) const ROWS_PER_MEASURE: u32 = 4 * ROWS_PER_BEAT;

/// Position in a song, in rows from beat 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Row(pub u32);

impl Row {
    /// Returns the row nearest to a beat. `None` for beats before the song, and for those that no row can number.
    pub(crate) fn nearest(beat: f64) -> Option<Self> {
        let rows = (beat * f64::from(ROWS_PER_BEAT)).round();
        (0.0..=f64::from(u32::MAX)).contains(&rows).then_some(Self(rows as u32))
    }

    pub(crate) fn beat(self) -> f64 {
        f64::from(self.0) / f64::from(ROWS_PER_BEAT)
    }
}

/// Lane of arrows, in the order of the panels of a dance pad from left to right, which is that of columns in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Lane {
    Left,
    Down,
    Up,
    Right,
}

impl Lane {
    pub(crate) const COUNT: usize = 4;
    pub(crate) const ALL: [Self; Self::COUNT] = [Self::Left, Self::Down, Self::Up, Self::Right];

    pub(crate) fn index(self) -> usize {
        self as usize
    }
}

/// Arrow of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Note {
    /// When to step.
    pub row: Row,
    pub lane: Lane,
    /// Length of a hold in rows, above 0. `None` for a single step.
    pub length_rows: Option<u32>,
}

impl Note {
    pub(crate) fn tap(row: Row, lane: Lane) -> Self {
        Self { row, lane, length_rows: None }
    }

    pub(crate) fn hold(row: Row, lane: Lane, length_rows: u32) -> Self {
        Self { row, lane, length_rows: Some(length_rows) }
    }

    pub(crate) fn beat(&self) -> f64 {
        self.row.beat()
    }

    /// Returns the last row of a hold. `None` for a single step.
    pub(crate) fn tail(&self) -> Option<Row> {
        self.length_rows.map(|length| Row(self.row.0.saturating_add(length)))
    }

    /// Returns the last row of the arrow, which is its only one unless it is a hold.
    pub(crate) fn last_row(&self) -> Row {
        self.tail().unwrap_or(self.row)
    }
}

/// Difficulty of a chart, from easy to hard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Difficulty {
    Easy,
    Medium,
    Hard,
}

impl Difficulty {
    pub(crate) const ALL: [Self; 3] = [Self::Easy, Self::Medium, Self::Hard];

    /// Name in files and on the screen.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Easy => "Easy",
            Self::Medium => "Medium",
            Self::Hard => "Hard",
        }
    }

    /// Returns the difficulty that a name in a StepMania file stands for. StepMania has five, of which the outer two on
    /// either side are one here, and it knows the names of older games too. `None` for all other names.
    pub(crate) fn from_stepmania(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "beginner" | "easy" | "basic" | "light" => Some(Self::Easy),
            "medium" | "another" | "trick" | "standard" | "difficult" => Some(Self::Medium),
            "hard" | "challenge" | "ssr" | "maniac" | "heavy" | "smaniac" | "expert" | "oni" => Some(Self::Hard),
            _ => None,
        }
    }

    /// Returns how many steps apart two difficulties are.
    pub(crate) fn distance(self, other: Self) -> u32 {
        (self as u32).abs_diff(other as u32)
    }
}

/// Arrows of a song at one difficulty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct StepChart {
    pub difficulty: Difficulty,
    /// How hard the chart is as its author sees it, from 1.
    pub meter: u32,
    notes: Vec<Note>,
}

impl StepChart {
    /// Makes a chart of notes in any order. No two may overlap in a lane.
    pub(crate) fn new(difficulty: Difficulty, meter: u32, mut notes: Vec<Note>) -> Result<Self, SongProblem> {
        notes.sort_unstable_by_key(|note| (note.row, note.lane));
        let mut last_rows = [None::<Row>; Lane::COUNT];
        for note in &notes {
            let last_row = &mut last_rows[note.lane.index()];
            if note.length_rows == Some(0) || note.tail().is_some_and(|tail| tail == Row(u32::MAX)) {
                return Err(SongProblem::HoldLength { beat: note.beat(), lane: note.lane });
            }
            if last_row.is_some_and(|last| note.row <= last) {
                return Err(SongProblem::Overlap { beat: note.beat(), lane: note.lane });
            }
            *last_row = Some(note.last_row());
        }
        Ok(Self { difficulty, meter, notes })
    }

    /// The notes by row, and those of one row from left to right.
    pub(crate) fn notes(&self) -> &[Note] {
        &self.notes
    }

    pub(crate) fn holds(&self) -> usize {
        self.notes.iter().filter(|note| note.length_rows.is_some()).count()
    }

    /// Returns the last row that has a note or part of a hold. `None` for a chart without notes.
    pub(crate) fn last_row(&self) -> Option<Row> {
        self.notes.iter().map(Note::last_row).max()
    }
}
