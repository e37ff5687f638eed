//! Writes StepMania files (`.sm`) that StepMania and [`Simfile::parse`] read.
//!
//! Numbers are written with as many digits as it takes to read the same ones. White space around titles is lost.

use super::{
    msd_tags::escape,
    simfile::Simfile,
    step_chart::{Lane, Note, ROWS_PER_MEASURE, StepChart},
    timing::PauseKind,
};
use std::fmt::Write;

/// Numbers of rows that StepMania divides measures into, without the finest.
const COARSE_DIVISIONS: [u32; 9] = [4, 8, 12, 16, 24, 32, 48, 64, 96];

impl Simfile {
    /// Returns the text of the file.
    pub(crate) fn to_sm(&self) -> String {
        let mut text = String::new();
        let titles = [("TITLE", &self.title), ("ARTIST", &self.artist), ("CREDIT", &self.credit)];
        for (tag, value) in titles.into_iter().chain([("MUSIC", &self.music)]) {
            push_tag(&mut text, tag, &escape(value));
        }
        push_tag(&mut text, "OFFSET", &self.timing.offset_seconds().to_string());
        push_tag(&mut text, "BPMS", &pairs(self.timing.tempos()));
        push_tag(&mut text, "STOPS", &pairs(self.timing.pauses(PauseKind::Stop)));
        push_tag(&mut text, "DELAYS", &pairs(self.timing.pauses(PauseKind::Delay)));
        for chart in &self.charts {
            push_chart(&mut text, chart);
        }
        text
    }
}

fn push_tag(text: &mut String, tag: &str, value: &str) {
    push(text, format_args!("#{tag}:{value};\n"));
}

fn push(text: &mut String, arguments: std::fmt::Arguments) {
    // A string takes all text: its writer has no error to return.
    let _ = text.write_fmt(arguments);
}

fn pairs(pairs: impl Iterator<Item = (f64, f64)>) -> String {
    pairs.map(|(beat, value)| format!("{beat}={value}")).collect::<Vec<_>>().join(",\n")
}

fn push_chart(text: &mut String, chart: &StepChart) {
    let (difficulty, meter) = (chart.difficulty.name(), chart.meter);
    push(text, format_args!("\n//---- dance-single, {difficulty} ----\n"));
    push(text, format_args!("#NOTES:\n dance-single:\n :\n {difficulty}:\n {meter}:\n 0,0,0,0,0:\n"));
    let cells = cells(chart.notes());
    let measures = chart.last_row().map_or(1, |row| row.0 / ROWS_PER_MEASURE + 1);
    let mut rest = cells.as_slice();
    for measure in 0..measures {
        if measure > 0 {
            push(text, format_args!(", // measure {}\n", measure + 1));
        }
        let start = measure * ROWS_PER_MEASURE;
        let (in_measure, later) = rest.split_at(rest.partition_point(|cell| cell.row - start < ROWS_PER_MEASURE));
        rest = later;
        push_measure(text, start, in_measure);
    }
    text.push_str(";\n");
}

/// What is in a row and column of a chart, other than nothing.
struct Cell {
    row: u32,
    lane: Lane,
    kind: char,
}

/// Returns the cells of notes, by row.
fn cells(notes: &[Note]) -> Vec<Cell> {
    let mut cells = Vec::with_capacity(2 * notes.len());
    for note in notes {
        let kind = if note.length_rows.is_some() { '2' } else { '1' };
        cells.push(Cell { row: note.row.0, lane: note.lane, kind });
        cells.extend(note.tail().map(|tail| Cell { row: tail.0, lane: note.lane, kind: '3' }));
    }
    cells.sort_unstable_by_key(|cell| (cell.row, cell.lane));
    cells
}

/// Writes a measure in as few rows as its cells allow.
fn push_measure(text: &mut String, start: u32, cells: &[Cell]) {
    let fits = |rows: &u32| cells.iter().all(|cell| (cell.row - start).is_multiple_of(ROWS_PER_MEASURE / rows));
    let rows = COARSE_DIVISIONS.into_iter().find(fits).unwrap_or(ROWS_PER_MEASURE);
    let mut cells = cells.iter().peekable();
    for row in (0..rows).map(|row| start + row * (ROWS_PER_MEASURE / rows)) {
        let mut columns = ['0'; Lane::COUNT];
        while let Some(cell) = cells.next_if(|cell| cell.row == row) {
            columns[cell.lane.index()] = cell.kind;
        }
        text.extend(columns);
        text.push('\n');
    }
}
