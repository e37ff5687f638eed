//! Beats and seconds, against times that were worked out by hand.

use crate::{
    random::Random,
    song::{Pause, PauseKind, Row, SongProblem, TempoChange, Timing},
};

/// Rounding error of times of some minutes.
const ROUNDING: f64 = 1e-9;

fn beat(beats: f64) -> Row {
    Row::nearest(beats).expect("the beat is within the song")
}

fn tempo(at: f64, bpm: f64) -> TempoChange {
    TempoChange::new(beat(at), bpm).expect("the tempo is playable")
}

fn pause(kind: PauseKind, at: f64, seconds: f64) -> Pause {
    Pause::new(kind, beat(at), seconds).expect("the pause is playable")
}

fn timing(offset: f64, tempos: &[TempoChange], pauses: &[Pause]) -> Timing {
    Timing::new(offset, tempos.to_vec(), pauses.to_vec()).expect("the timing is playable")
}

fn assert_near(found: f64, expected: f64) {
    assert!((found - expected).abs() < ROUNDING, "{found} instead of {expected}");
}

#[test]
fn beat_0_is_at_the_negative_of_the_offset() {
    let timing = timing(-0.25, &[tempo(0.0, 120.0)], &[]);
    assert_near(timing.seconds_at(0.0), 0.25);
    assert_near(timing.seconds_at(4.0), 2.25);
    assert_near(timing.seconds_at(-0.5), 0.0);
    assert_near(timing.beat_at(0.0), -0.5);
}

#[test]
fn a_tempo_lasts_until_the_next_one() {
    let timing = timing(0.0, &[tempo(8.0, 60.0), tempo(0.0, 120.0), tempo(12.0, 240.0)], &[]);
    for (beat, seconds) in [(8.0, 4.0), (10.0, 6.0), (12.0, 8.0), (16.0, 9.0)] {
        assert_near(timing.seconds_at(beat), seconds);
        assert_near(timing.beat_at(seconds), beat);
    }
    assert_near(timing.bpm_at(7.9), 120.0);
    assert_near(timing.bpm_at(8.0), 60.0);
    assert_near(timing.bpm_at(-3.0), 120.0);
}

#[test]
fn a_stop_holds_the_beat_after_its_arrow() {
    let timing = timing(0.0, &[tempo(0.0, 60.0)], &[pause(PauseKind::Stop, 2.0, 0.5)]);
    assert_near(timing.seconds_at(2.0), 2.0);
    assert_near(timing.seconds_at(3.0), 3.5);
    for seconds in [2.0, 2.3, 2.5] {
        assert_near(timing.beat_at(seconds), 2.0);
    }
    assert_near(timing.beat_at(3.5), 3.0);
}

#[test]
fn a_delay_holds_the_beat_before_its_arrow() {
    let pauses = [pause(PauseKind::Stop, 2.0, 0.5), pause(PauseKind::Delay, 2.0, 0.25)];
    let timing = timing(0.0, &[tempo(0.0, 60.0)], &pauses);
    assert_near(timing.seconds_at(2.0), 2.25);
    assert_near(timing.seconds_at(3.0), 3.75);
    for seconds in [2.0, 2.25, 2.75] {
        assert_near(timing.beat_at(seconds), 2.0);
    }
}

#[test]
fn a_stop_and_a_tempo_change_can_share_a_row() {
    let tempos = [tempo(0.0, 60.0), tempo(2.0, 120.0)];
    let timing = timing(0.0, &tempos, &[pause(PauseKind::Stop, 2.0, 1.0)]);
    assert_near(timing.seconds_at(2.0), 2.0);
    assert_near(timing.seconds_at(4.0), 4.0);
}

#[test]
fn of_two_tempos_at_a_row_the_later_one_counts() {
    let twice = timing(0.0, &[tempo(0.0, 60.0), tempo(0.0, 120.0)], &[]);
    assert_eq!(twice, timing(0.0, &[tempo(0.0, 120.0)], &[]));
}

#[test]
fn seconds_and_beats_are_inverse_in_random_songs() {
    let mut random = Random::new(7);
    for _ in 0..200 {
        let mut tempos = vec![tempo(0.0, random.between(40.0, 300.0))];
        let mut pauses = Vec::new();
        for _ in 0..random.below(12) {
            tempos.push(tempo(random.between(0.0, 200.0), random.between(20.0, 400.0)));
            let kind = if random.unit() < 0.5 { PauseKind::Stop } else { PauseKind::Delay };
            pauses.push(pause(kind, random.between(0.0, 200.0), random.between(0.0, 2.0)));
        }
        let timing = timing(random.between(-2.0, 2.0), &tempos, &pauses);
        let mut last = f64::NEG_INFINITY;
        for row in -96..9_600 {
            let beat = f64::from(row) / 48.0;
            let seconds = timing.seconds_at(beat);
            assert!(seconds > last, "beat {beat} is at {seconds} s, and the row before at {last} s");
            assert_near(timing.beat_at(seconds), beat);
            last = seconds;
        }
    }
}

#[test]
fn tempos_and_pauses_that_skip_beats_are_errors() {
    for bpm in [0.0, -120.0, f64::NAN, f64::INFINITY, 99_999_999.0] {
        let found = TempoChange::new(beat(4.0), bpm);
        assert!(matches!(found, Err(SongProblem::Tempo { beat: 4.0, .. })), "{bpm}: {found:?}");
    }
    for seconds in [-0.5, f64::NAN, f64::INFINITY] {
        let found = Pause::new(PauseKind::Stop, beat(4.0), seconds);
        assert!(matches!(found, Err(SongProblem::Pause { beat: 4.0, .. })), "{seconds}: {found:?}");
    }
}

#[test]
fn a_song_needs_a_tempo_at_beat_0_and_a_finite_offset() {
    let late = Timing::new(0.0, vec![tempo(4.0, 120.0)], Vec::new());
    assert_eq!(late, Err(SongProblem::NoFirstTempo { first_beat: Some(4.0) }));
    assert_eq!(Timing::new(0.0, Vec::new(), Vec::new()), Err(SongProblem::NoFirstTempo { first_beat: None }));
    let offset = Timing::new(f64::INFINITY, vec![tempo(0.0, 120.0)], Vec::new());
    assert_eq!(offset, Err(SongProblem::Offset(f64::INFINITY)));
}
