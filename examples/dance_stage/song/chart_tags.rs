//! Charts in the tags of StepMania files: one tag each in `.sm`, a row of tags each in `.ssc`.

use super::{
    chart_rows::read_rows,
    msd_tags::{Tag, Value},
    song_error::{Mistake, SongProblem},
    step_chart::{Difficulty, StepChart},
};

/// Place of the values of `#NOTES` in `.sm`.
const STEPS_TYPE: usize = 0;
const DIFFICULTY: usize = 2;
const METER: usize = 3;
const ROWS: usize = 5;

/// Tag with which the charts of an `.ssc` file begin.
pub(super) const CHART_START: &str = "NOTEDATA";
/// Tags with the timing of a song, or of a chart in an `.ssc` file.
const TIMING: [&str; 4] = ["BPMS", "STOPS", "DELAYS", "WARPS"];

/// What a file says of a chart.
struct ChartTags<'a> {
    difficulty: (&'a str, usize),
    meter: (&'a str, usize),
    rows: &'a Value,
    line: usize,
}

/// Reads all charts for this game, and counts their mines.
pub(super) fn read_charts(tags: &[Tag]) -> Result<(Vec<StepChart>, usize), Mistake> {
    let (mut charts, mut mines) = (Vec::new(), 0);
    let start = tags.iter().position(|tag| tag.name == CHART_START).unwrap_or(tags.len());
    let (of_song, ssc) = tags.split_at(start);
    let sm = of_song.iter().filter(|tag| tag.name == "NOTES").map(of_sm);
    let ssc = ssc.chunk_by(|_, next| next.name != CHART_START).map(|tags| of_ssc(tags, of_song));
    for found in sm.chain(ssc) {
        let Some(found) = found? else { continue };
        let (difficulty, line) = found.difficulty;
        let difficulty = Difficulty::from_stepmania(difficulty)
            .ok_or_else(|| SongProblem::Difficulty { found: difficulty.to_owned() }.at(line))?;
        let (meter, line) = found.meter;
        let meter = match meter.parse() {
            Ok(meter) if meter > 0 => meter,
            _ => return Err(SongProblem::Meter { found: meter.to_owned() }.at(line)),
        };
        let rows = read_rows(found.rows)?;
        charts.push(StepChart::new(difficulty, meter, rows.notes).map_err(|problem| problem.at(found.line))?);
        mines += rows.mines;
    }
    Ok((charts, mines))
}

fn is_for_this_game(steps_type: &str, difficulty: &str) -> bool {
    steps_type.eq_ignore_ascii_case("dance-single") && !difficulty.eq_ignore_ascii_case("edit")
}

/// The chart in a `#NOTES`; `None` if it is not for this game.
fn of_sm(tag: &Tag) -> Result<Option<ChartTags<'_>>, Mistake> {
    if !is_for_this_game(tag.text(STEPS_TYPE), tag.text(DIFFICULTY)) {
        return Ok(None);
    }
    let rows = tag.values.get(ROWS).ok_or_else(|| SongProblem::ChartParts { found: tag.values.len() }.at(tag.line))?;
    let value = |index: usize| (tag.text(index), tag.values.get(index).map_or(tag.line, Value::first_line));
    let (difficulty, meter) = (value(DIFFICULTY), value(METER));
    Ok(Some(ChartTags { difficulty, meter, rows, line: tag.line }))
}

/// The chart in the tags from a `#NOTEDATA` on; `None` if it is not for this game, or has another timing than the song.
fn of_ssc<'a>(tags: &'a [Tag], of_song: &[Tag]) -> Result<Option<ChartTags<'a>>, Mistake> {
    let find = |name: &str| tags.iter().rfind(|tag| tag.name == name);
    let line = tags.first().map_or(1, |tag| tag.line);
    let value = |name| find(name).map_or(("", line), |tag| (tag.text(0), tag.line));
    let (steps_type, difficulty, meter) = (value("STEPSTYPE").0, value("DIFFICULTY"), value("METER"));
    let of_song = |name: &str| of_song.iter().rfind(|tag| tag.name == name).map_or("", |tag| tag.text(0));
    let has_own_timing = TIMING.iter().any(|name| !["", of_song(name)].contains(&value(name).0));
    if has_own_timing || !is_for_this_game(steps_type, difficulty.0) {
        return Ok(None);
    }
    let notes = find("NOTES").and_then(|tag| tag.values.first());
    let rows = notes.ok_or_else(|| SongProblem::NoRows.at(line))?;
    Ok(Some(ChartTags { difficulty, meter, rows, line }))
}
