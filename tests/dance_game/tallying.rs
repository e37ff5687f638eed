//! Score, combo, life and letters, against sums that were worked out by hand.

use super::judging::{at, chart};
use crate::{
    rules::{Grade, HoldGrade, JudgeEvent, JudgeEventKind, LetterGrade, Tally, Verdict},
    song::{Lane, Note, StepChart},
};

fn taps(count: u32) -> StepChart {
    chart((0..count).map(|i| Note::tap(at(f64::from(i)), Lane::Left)).collect())
}

fn count(tally: &mut Tally, grades: &[(Grade, u32)]) {
    for (grade, times) in grades {
        for _ in 0..*times {
            if *grade == Grade::Miss {
                tally.count_event(&event(JudgeEventKind::Missed));
            } else {
                tally.count_step(&Verdict { note: 0, lane: Lane::Left, grade: *grade, error_seconds: 0.0 });
            }
        }
    }
}

fn event(kind: JudgeEventKind) -> JudgeEvent {
    JudgeEvent { seconds: 0.0, note: 0, lane: Lane::Left, kind }
}

fn tallied(chart: &StepChart, grades: &[(Grade, u32)]) -> Tally {
    let mut tally = Tally::new(chart);
    count(&mut tally, grades);
    tally
}

#[test]
fn the_score_is_the_fraction_of_dance_points() {
    let grades = [(Grade::Marvelous, 4), (Grade::Perfect, 3), (Grade::Great, 2), (Grade::Good, 1), (Grade::Almost, 1)];
    let tally = tallied(&taps(12), &[&grades[..], &[(Grade::Miss, 1)]].concat());
    assert_eq!(tally.score(), (4.0 * 3.0 + 3.0 * 2.0 + 2.0) / 36.0);
    assert_eq!(tally.score_text(), "55.55 %");
    assert_eq!(Grade::ALL.map(|grade| tally.hits(grade)), [4, 3, 2, 1, 1, 1]);
}

#[test]
fn holds_count_as_much_as_steps() {
    let chart = chart(vec![Note::hold(at(0.0), Lane::Left, 48), Note::hold(at(4.0), Lane::Left, 48)]);
    let mut tally = tallied(&chart, &[(Grade::Marvelous, 2)]);
    tally.count_event(&event(JudgeEventKind::HoldEnded(HoldGrade::Held)));
    tally.count_event(&event(JudgeEventKind::HoldEnded(HoldGrade::LetGo)));
    assert_eq!(tally.score_text(), "75.00 %");
    assert_eq!(tally.holds(), (1, 1));
    // (2 · 2 + 6) of (2 · 2 + 2 · 6) grade points
    assert_eq!(tally.letter(), LetterGrade::C);
}

#[test]
fn only_a_perfect_dance_has_100_percent() {
    assert_eq!(tallied(&taps(20_000), &[(Grade::Marvelous, 20_000)]).score_text(), "100.00 %");
    let nearly = [(Grade::Marvelous, 19_999), (Grade::Perfect, 1)];
    assert_eq!(tallied(&taps(20_000), &nearly).score_text(), "99.99 %");
    assert_eq!(Tally::new(&taps(0)).score_text(), "0.00 %");
}

#[test]
fn a_combo_goes_on_as_long_as_steps_are_great() {
    let mut tally = tallied(&taps(20), &[(Grade::Great, 3), (Grade::Marvelous, 2)]);
    assert_eq!(tally.combo(), 5);
    for breaking in [Grade::Good, Grade::Almost, Grade::Miss] {
        count(&mut tally, &[(breaking, 1)]);
        assert_eq!(tally.combo(), 0, "{breaking:?}");
        count(&mut tally, &[(Grade::Perfect, 2)]);
    }
    assert_eq!((tally.combo(), tally.best_combo()), (2, 5));
}

#[test]
fn life_follows_each_step() {
    let life = |grades: &[(Grade, u32)]| tallied(&taps(500), grades).life();
    assert_eq!(life(&[]), 0.5);
    assert_eq!(life(&[(Grade::Marvelous, 1), (Grade::Perfect, 1), (Grade::Great, 1), (Grade::Good, 9)]), 0.52);
    assert_eq!(life(&[(Grade::Almost, 1)]), 0.46);
    assert_eq!(life(&[(Grade::Miss, 1)]), 0.42);
    assert_eq!(life(&[(Grade::Marvelous, 500)]), 1.0);
}

#[test]
fn life_rises_again_from_the_fifth_good_step_after_a_loss() {
    let mut tally = tallied(&taps(20), &[(Grade::Miss, 1), (Grade::Marvelous, 4)]);
    assert_eq!(tally.life(), 0.42);
    count(&mut tally, &[(Grade::Marvelous, 1)]);
    assert_eq!(tally.life(), 0.428);
    tally.count_event(&event(JudgeEventKind::HoldEnded(HoldGrade::LetGo)));
    tally.count_event(&event(JudgeEventKind::HoldEnded(HoldGrade::Held)));
    assert_eq!(tally.life(), 0.348);
}

#[test]
fn a_dance_without_life_has_failed_for_good() {
    let mut tally = tallied(&taps(1_000), &[(Grade::Miss, 6)]);
    assert!(!tally.has_failed());
    count(&mut tally, &[(Grade::Miss, 1), (Grade::Marvelous, 900)]);
    assert!(tally.has_failed());
    assert_eq!((tally.life(), tally.letter()), (0.0, LetterGrade::E));
}

#[test]
fn letters_follow_the_tiers_of_stepmania() {
    let letters = [
        (&[(Grade::Marvelous, 100)][..], LetterGrade::Aaaa),
        (&[(Grade::Marvelous, 99), (Grade::Perfect, 1)], LetterGrade::Aaa),
        (&[(Grade::Marvelous, 86), (Grade::Great, 14)], LetterGrade::Aa),
        (&[(Grade::Marvelous, 85), (Grade::Great, 15)], LetterGrade::A),
        (&[(Grade::Perfect, 60), (Grade::Great, 40)], LetterGrade::A),
        (&[(Grade::Perfect, 59), (Grade::Great, 41)], LetterGrade::B),
        (&[(Grade::Perfect, 30), (Grade::Great, 70)], LetterGrade::B),
        (&[(Grade::Perfect, 29), (Grade::Great, 71)], LetterGrade::C),
        (&[(Grade::Great, 90), (Grade::Good, 10)], LetterGrade::C),
        (&[(Grade::Great, 89), (Grade::Good, 11)], LetterGrade::D),
    ];
    for (grades, letter) in letters {
        assert_eq!(tallied(&taps(100), grades).letter(), letter, "{grades:?}");
    }
    // A single miss costs as much as four perfect steps bring.
    assert_eq!(tallied(&taps(100), &[(Grade::Marvelous, 99), (Grade::Miss, 1)]).letter(), LetterGrade::Aa);
    assert_eq!(Tally::new(&taps(0)).letter(), LetterGrade::D);
}

#[test]
fn a_hold_that_was_let_go_takes_the_best_letters() {
    let chart = chart(vec![Note::hold(at(0.0), Lane::Left, 48), Note::tap(at(4.0), Lane::Left)]);
    let mut held = tallied(&chart, &[(Grade::Marvelous, 2)]);
    let mut let_go = held.clone();
    held.count_event(&event(JudgeEventKind::HoldEnded(HoldGrade::Held)));
    let_go.count_event(&event(JudgeEventKind::HoldEnded(HoldGrade::LetGo)));
    assert_eq!((held.letter(), let_go.letter()), (LetterGrade::Aaaa, LetterGrade::D));
}

#[test]
fn all_grades_have_names_for_the_screen() {
    assert_eq!(Grade::ALL.map(Grade::name), ["Marvelous", "Perfect", "Great", "Good", "Almost", "Miss"]);
    assert_eq!([HoldGrade::Held, HoldGrade::LetGo].map(HoldGrade::name), ["OK", "NG"]);
    let letters = [LetterGrade::Aaaa, LetterGrade::Aaa, LetterGrade::Aa, LetterGrade::A, LetterGrade::B];
    assert_eq!(letters.map(LetterGrade::name), ["AAAA", "AAA", "AA", "A", "B"]);
    assert_eq!([LetterGrade::C, LetterGrade::D, LetterGrade::E].map(LetterGrade::name), ["C", "D", "E"]);
}
