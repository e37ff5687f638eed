//! Rows of a chart in a StepMania file.
//!
//! A measure is four beats. It has as many lines as it is divided into, each of one character a lane, and commas stand
//! between measures.

use super::{
    msd_tags::Value,
    song_error::{Mistake, SongProblem},
    step_chart::{Lane, Note, ROWS_PER_MEASURE, Row},
};

/// Notes of a chart, and what was left out.
#[derive(Default)]
pub(super) struct ChartRows {
    pub notes: Vec<Note>,
    /// Number of mines, which the game does not have.
    pub mines: usize,
    /// Beginnings of the holds that have not ended.
    open_holds: [Option<OpenHold>; Lane::COUNT],
    measures: u32,
}

#[derive(Clone, Copy)]
struct OpenHold {
    line: usize,
    row: Row,
}

/// Reads the notes of a chart.
pub(super) fn read_rows(value: &Value) -> Result<ChartRows, Mistake> {
    let mut chart = ChartRows::default();
    let mut measure: Vec<(usize, &str)> = Vec::new();
    for (line, text) in (value.line..).zip(value.text.split('\n')) {
        let mut pieces = text.split(',');
        measure.extend(row_in(line, pieces.next()));
        for piece in pieces {
            chart.add_measure(line, &measure)?;
            measure.clear();
            measure.extend(row_in(line, Some(piece)));
        }
    }
    let last_line = value.line + value.text.matches('\n').count();
    chart.add_measure(last_line, &measure)?;
    for lane in Lane::ALL {
        if let Some(hold) = chart.open_holds[lane.index()] {
            return Err(SongProblem::HoldWithoutEnd { lane }.at(hold.line));
        }
    }
    Ok(chart)
}

fn row_in(line: usize, text: Option<&str>) -> Option<(usize, &str)> {
    text.map(|text| (line, text.trim())).filter(|(_, row)| !row.is_empty())
}

impl ChartRows {
    /// Adds the rows of a measure that ends in `line`. A measure without rows is silent.
    fn add_measure(&mut self, line: usize, rows: &[(usize, &str)]) -> Result<(), Mistake> {
        // The row after the measure has to have a number too.
        let start = self.measures.checked_mul(ROWS_PER_MEASURE).filter(|start| *start <= u32::MAX - ROWS_PER_MEASURE);
        let start = start.ok_or_else(|| SongProblem::TooLong.at(line))?;
        self.measures += 1;
        let Some((first_line, _)) = rows.first() else { return Ok(()) };
        let step = match u32::try_from(rows.len()) {
            Ok(count) if ROWS_PER_MEASURE.is_multiple_of(count) => ROWS_PER_MEASURE / count,
            _ => return Err(SongProblem::MeasureRows { found: rows.len() }.at(*first_line)),
        };
        for (i, (line, text)) in (0..).zip(rows) {
            self.add_row(*line, Row(start + i * step), text).map_err(|problem| problem.at(*line))?;
        }
        Ok(())
    }

    fn add_row(&mut self, line: usize, row: Row, text: &str) -> Result<(), SongProblem> {
        let mut columns = text.chars();
        let kinds = [columns.next(), columns.next(), columns.next(), columns.next()];
        let ([Some(left), Some(down), Some(up), Some(right)], None) = (kinds, columns.next()) else {
            return Err(SongProblem::Columns { found: text.to_owned() });
        };
        for (lane, kind) in Lane::ALL.into_iter().zip([left, down, up, right]) {
            let open_hold = &mut self.open_holds[lane.index()];
            match (kind, *open_hold) {
                ('0', _) => {}
                ('M' | 'm', _) => self.mines += 1,
                ('1' | '2' | '4', Some(_)) => return Err(SongProblem::WithinHold { lane }),
                ('1', None) => self.notes.push(Note::tap(row, lane)),
                ('2' | '4', None) => *open_hold = Some(OpenHold { line, row }),
                ('3', Some(head)) => {
                    self.notes.push(Note::hold(head.row, lane, row.0 - head.row.0));
                    *open_hold = None;
                }
                ('3', None) => return Err(SongProblem::EndWithoutHold { lane }),
                (found, _) => return Err(SongProblem::NoteKind { row: text.to_owned(), found }),
            }
        }
        Ok(())
    }
}
