//! Which arrow a step hits, what is missed, and which holds are held. All songs here have one beat a second.

use crate::{
    rules::{Grade, HoldGrade, Judge, JudgeEvent, JudgeEventKind, TimingWindows},
    song::{Difficulty, Lane, Note, ROWS_PER_BEAT, Row, StepChart, TempoChange, Timing},
};

const HELD: JudgeEventKind = JudgeEventKind::HoldEnded(HoldGrade::Held);
const LET_GO: JudgeEventKind = JudgeEventKind::HoldEnded(HoldGrade::LetGo);

pub(crate) fn one_beat_a_second() -> Timing {
    let tempo = TempoChange::new(Row(0), 60.0).expect("the tempo is playable");
    Timing::new(0.0, vec![tempo], Vec::new()).expect("there is a tempo at beat 0")
}

/// Returns the row at a time in such a song.
pub(crate) fn at(seconds: f64) -> Row {
    Row::nearest(seconds).expect("the time is within the song")
}

pub(crate) fn chart(notes: Vec<Note>) -> StepChart {
    StepChart::new(Difficulty::Medium, 5, notes).expect("no notes overlap")
}

fn judge(notes: Vec<Note>) -> Judge {
    Judge::new(&chart(notes), &one_beat_a_second(), TimingWindows::default())
}

/// Returns what a judge finds out by a time: when, about which note, and what.
fn events(judge: &mut Judge, seconds: f64) -> Vec<(f64, usize, JudgeEventKind)> {
    let round = |seconds: f64| (seconds * 1e6).round() / 1e6;
    judge.advance(seconds).iter().map(|event| (round(event.seconds), event.note, event.kind)).collect()
}

#[test]
fn grades_follow_the_windows_of_stepmania() {
    let windows = TimingWindows::default();
    let grades = [
        (0.0, Some(Grade::Marvelous)),
        (0.0225, Some(Grade::Marvelous)),
        (0.0226, Some(Grade::Perfect)),
        (0.045, Some(Grade::Perfect)),
        (0.0451, Some(Grade::Great)),
        (0.090, Some(Grade::Great)),
        (0.0901, Some(Grade::Good)),
        (0.135, Some(Grade::Good)),
        (0.1351, Some(Grade::Almost)),
        (0.180, Some(Grade::Almost)),
        (0.1801, None),
        (f64::NAN, None),
    ];
    for (error, grade) in grades {
        assert_eq!(windows.grade(error), grade, "{error}");
        assert_eq!(windows.grade(-error), grade, "-{error}");
    }
    assert_eq!(TimingWindows::scaled(2.0).grade(0.045), Some(Grade::Marvelous));
    assert_eq!(TimingWindows::scaled(0.0), TimingWindows::scaled(TimingWindows::MIN_SCALE));
    assert_eq!(TimingWindows::scaled(f64::INFINITY), TimingWindows::scaled(TimingWindows::MAX_SCALE));
    assert_eq!(TimingWindows::scaled(f64::NAN), TimingWindows::default());
}

#[test]
fn a_step_says_how_late_it_is() {
    let mut judge = judge(vec![Note::tap(at(1.0), Lane::Up)]);
    let verdict = judge.press(Lane::Up, 0.9).expect("the arrow is in reach");
    assert_eq!((verdict.note, verdict.lane, verdict.grade), (0, Lane::Up, Grade::Good));
    assert!((verdict.error_seconds + 0.1).abs() < 1e-12, "{verdict:?}");
    assert_eq!(judge.grade_of(0), Some(Grade::Good));
    assert!(judge.is_finished());
    // An arrow is hit once.
    assert_eq!(judge.press(Lane::Up, 1.0), None);
}

#[test]
fn steps_hit_only_arrows_of_their_lane_and_within_reach() {
    let mut judge = judge(vec![Note::tap(at(1.0), Lane::Up)]);
    for (lane, seconds) in [(Lane::Down, 1.0), (Lane::Up, 0.81), (Lane::Up, 1.19), (Lane::Up, f64::NAN)] {
        assert_eq!(judge.press(lane, seconds), None, "{lane:?} at {seconds}");
    }
    assert_eq!(judge.grade_of(0), None);
}

#[test]
fn the_nearest_arrow_is_hit() {
    let mut judge = judge(vec![Note::tap(at(1.0), Lane::Up), Note::tap(at(1.25), Lane::Up)]);
    assert_eq!(judge.press(Lane::Up, 1.13).map(|verdict| verdict.note), Some(1));
    // The first one is still there, also for a step after the second one's.
    assert_eq!(judge.press(Lane::Up, 1.14).map(|verdict| verdict.note), Some(0));
    assert!(judge.is_finished());
}

#[test]
fn of_two_arrows_equally_near_the_earlier_one_is_hit() {
    let mut judge = judge(vec![Note::tap(at(1.0), Lane::Up), Note::tap(at(1.25), Lane::Up)]);
    assert_eq!(judge.press(Lane::Up, 1.125).map(|verdict| verdict.note), Some(0));
}

#[test]
fn arrows_of_a_jump_are_judged_one_by_one() {
    let mut judge = judge(vec![Note::tap(at(1.0), Lane::Left), Note::tap(at(1.0), Lane::Right)]);
    assert_eq!(judge.press(Lane::Left, 1.01).map(|verdict| verdict.grade), Some(Grade::Marvelous));
    assert_eq!(judge.press(Lane::Right, 1.08).map(|verdict| verdict.grade), Some(Grade::Great));
}

#[test]
fn arrows_out_of_reach_are_missed_in_the_order_of_time() {
    let notes = vec![Note::tap(at(1.5), Lane::Left), Note::tap(at(1.0), Lane::Right), Note::tap(at(9.0), Lane::Up)];
    let mut judge = judge(notes);
    assert_eq!(events(&mut judge, 1.18), []);
    let missed = JudgeEventKind::Missed;
    assert_eq!(events(&mut judge, 3.0), [(1.18, 0, missed), (1.68, 1, missed)]);
    assert_eq!(events(&mut judge, 3.1), []);
    assert_eq!(judge.grade_of(0), Some(Grade::Miss));
    assert!(!judge.is_finished());
}

#[test]
fn a_hold_is_held_to_its_end() {
    let mut judge = judge(vec![Note::hold(at(1.0), Lane::Up, 2 * ROWS_PER_BEAT)]);
    judge.press(Lane::Up, 1.0);
    assert_eq!(judge.hold_in(Lane::Up), Some((0, true)));
    assert_eq!(events(&mut judge, 2.99), []);
    assert!(!judge.is_finished());
    assert_eq!(events(&mut judge, 3.1), [(3.0, 0, HELD)]);
    assert_eq!(judge.hold_in(Lane::Up), None);
    assert!(judge.is_finished());
}

#[test]
fn a_foot_may_leave_a_hold_for_a_moment() {
    let mut judge = judge(vec![Note::hold(at(1.0), Lane::Up, 2 * ROWS_PER_BEAT)]);
    judge.press(Lane::Up, 1.0);
    judge.release(Lane::Up, 1.5);
    assert_eq!(judge.hold_in(Lane::Up), Some((0, false)));
    assert_eq!(events(&mut judge, 1.74), []);
    assert_eq!(judge.press(Lane::Up, 1.745), None);
    // The end is near enough for a foot that leaves now.
    judge.release(Lane::Up, 2.76);
    assert_eq!(events(&mut judge, 3.5), [(3.0, 0, HELD)]);
}

#[test]
fn a_hold_without_a_foot_is_let_go() {
    let mut judge = judge(vec![Note::hold(at(1.0), Lane::Up, 2 * ROWS_PER_BEAT)]);
    judge.press(Lane::Up, 1.0);
    judge.release(Lane::Up, 1.5);
    // The foot comes back too late, and within the same frame.
    judge.press(Lane::Up, 1.76);
    assert_eq!(events(&mut judge, 1.8), [(1.75, 0, LET_GO)]);
    assert!(judge.is_finished());
}

#[test]
fn time_off_a_hold_counts_from_its_start() {
    let mut judge = judge(vec![Note::hold(at(1.0), Lane::Up, 2 * ROWS_PER_BEAT)]);
    judge.press(Lane::Up, 0.85);
    judge.release(Lane::Up, 0.9);
    assert_eq!(events(&mut judge, 1.24), []);
    assert_eq!(events(&mut judge, 1.26), [(1.25, 0, LET_GO)]);
}

#[test]
fn a_missed_hold_does_not_begin() {
    let mut judge = judge(vec![Note::hold(at(1.0), Lane::Up, 2 * ROWS_PER_BEAT)]);
    assert_eq!(events(&mut judge, 1.5), [(1.18, 0, JudgeEventKind::Missed)]);
    judge.press(Lane::Up, 1.6);
    assert_eq!(judge.hold_in(Lane::Up), None);
    assert_eq!(events(&mut judge, 4.0), []);
    assert!(judge.is_finished());
}

#[test]
fn a_hold_right_before_another_one_is_held_if_the_next_is_hit_early() {
    let second = Note::hold(at(2.0), Lane::Up, ROWS_PER_BEAT);
    let mut judge = judge(vec![Note::hold(at(1.0), Lane::Up, ROWS_PER_BEAT - 2), second]);
    judge.press(Lane::Up, 1.0);
    judge.release(Lane::Up, 1.85);
    assert_eq!(judge.press(Lane::Up, 1.9).map(|verdict| verdict.note), Some(1));
    assert_eq!(judge.hold_in(Lane::Up), Some((1, true)));
    assert_eq!(events(&mut judge, 1.95), [(1.9, 0, HELD)]);
    assert_eq!(events(&mut judge, 3.0), [(3.0, 1, HELD)]);
}

#[test]
fn a_long_frame_judges_as_many_short_ones_do() {
    let notes: Vec<_> = (1..40).map(|i| Note::tap(at(0.25 * f64::from(i)), Lane::ALL[i as usize % 4])).collect();
    let count = notes.len();
    let (mut short, mut long) = (judge(notes.clone()), judge(notes));
    let mut many: Vec<JudgeEvent> = Vec::new();
    for frame in 0..1_200 {
        many.extend(short.advance(f64::from(frame) / 60.0));
    }
    assert_eq!(long.advance(20.0), many);
    assert_eq!(many.len(), count);
}
