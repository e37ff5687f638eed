//! Rows, lanes, difficulties and the rules of charts.

use crate::song::{Difficulty, Lane, Note, ROWS_PER_BEAT, Row, SongProblem, StepChart};

#[test]
fn rows_are_exact_in_beats() {
    assert_eq!(Row(72).beat(), 1.5);
    assert_eq!(Row::nearest(1.5), Some(Row(72)));
    // A triplet with the six digits that StepMania writes.
    assert_eq!(Row::nearest(12.333_333), Some(Row(12 * ROWS_PER_BEAT + 16)));
    for row in [0, 1, 47, 191, 1_000_003, u32::MAX] {
        assert_eq!(Row::nearest(Row(row).beat()), Some(Row(row)));
    }
}

#[test]
fn beats_without_a_row_have_none() {
    for beat in [-0.5, f64::NAN, f64::INFINITY, 1e9] {
        assert_eq!(Row::nearest(beat), None, "{beat}");
    }
}

#[test]
fn charts_are_sorted_by_row_and_from_left_to_right() {
    let notes = vec![
        Note::tap(Row(96), Lane::Left),
        Note::tap(Row(48), Lane::Right),
        Note::hold(Row(48), Lane::Down, 48),
        Note::tap(Row(0), Lane::Up),
    ];
    let chart = StepChart::new(Difficulty::Easy, 1, notes).expect("no notes overlap");
    let order: Vec<_> = chart.notes().iter().map(|note| (note.row.0, note.lane)).collect();
    assert_eq!(order, [(0, Lane::Up), (48, Lane::Down), (48, Lane::Right), (96, Lane::Left)]);
    assert_eq!((chart.holds(), chart.last_row()), (1, Some(Row(96))));
}

#[test]
fn notes_that_overlap_in_a_lane_are_an_error() {
    let chart = |notes| StepChart::new(Difficulty::Hard, 9, notes);
    let overlap = Err(SongProblem::Overlap { beat: 2.0, lane: Lane::Up });
    assert_eq!(chart(vec![Note::tap(Row(96), Lane::Up), Note::tap(Row(96), Lane::Up)]), overlap);
    // The end of a hold is part of it.
    assert_eq!(chart(vec![Note::hold(Row(48), Lane::Up, 48), Note::tap(Row(96), Lane::Up)]), overlap);
    assert!(chart(vec![Note::hold(Row(48), Lane::Up, 48), Note::tap(Row(96), Lane::Down)]).is_ok());
    assert!(chart(vec![Note::hold(Row(48), Lane::Up, 48), Note::tap(Row(97), Lane::Up)]).is_ok());
}

#[test]
fn holds_have_a_length_and_end_within_the_song() {
    for (row, length) in [(0, 0), (u32::MAX - 5, 100)] {
        let chart = StepChart::new(Difficulty::Easy, 1, vec![Note::hold(Row(row), Lane::Left, length)]);
        assert!(matches!(chart, Err(SongProblem::HoldLength { lane: Lane::Left, .. })), "{chart:?}");
    }
}

#[test]
fn the_names_of_stepmania_are_three_difficulties() {
    let names = [
        ("Beginner", Some(Difficulty::Easy)),
        ("Easy", Some(Difficulty::Easy)),
        ("medium", Some(Difficulty::Medium)),
        ("HARD", Some(Difficulty::Hard)),
        ("Challenge", Some(Difficulty::Hard)),
        ("smaniac", Some(Difficulty::Hard)),
        ("Edit", None),
        ("", None),
    ];
    for (name, difficulty) in names {
        assert_eq!(Difficulty::from_stepmania(name), difficulty, "{name}");
    }
    for difficulty in Difficulty::ALL {
        assert_eq!(Difficulty::from_stepmania(difficulty.name()), Some(difficulty));
    }
}
