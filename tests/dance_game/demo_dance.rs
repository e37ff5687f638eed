//! Whole dances of the demo player: a minute at a fixed frame rate, without an engine.

use crate::{
    random::Random,
    rules::{DemoPlayer, Grade, Judge, JudgeEventKind, Step, StepKind, Tally, TimingWindows},
    song::{Difficulty, Lane, Note, Pause, PauseKind, ROWS_PER_BEAT, Row, StepChart, TempoChange, Timing},
};
use std::time::{Duration, Instant};

const SECONDS: f64 = 60.0;
const FRAMES_PER_SECOND: f64 = 60.0;
const SEEDS: std::ops::Range<u64> = 0..5;

/// What a dance came to.
#[derive(Debug, PartialEq)]
struct Dance {
    tally: Tally,
    errors: Vec<f64>,
    unwanted_steps: usize,
    is_finished: bool,
}

fn timing() -> Timing {
    let tempo = |beat: f64, bpm| TempoChange::new(Row::nearest(beat).expect("in the song"), bpm).expect("playable");
    let stop = Pause::new(PauseKind::Stop, Row(64 * ROWS_PER_BEAT), 0.4).expect("playable");
    Timing::new(-0.3, vec![tempo(0.0, 130.0), tempo(64.0, 174.0)], vec![stop]).expect("there is a tempo at beat 0")
}

/// Makes a chart of `steps_per_beat` over a bit less than the minute, with jumps and holds.
fn chart(difficulty: Difficulty, steps_per_beat: u32, timing: &Timing) -> StepChart {
    let mut random = Random::new(steps_per_beat.into());
    let mut notes = Vec::new();
    let mut free = [0; Lane::COUNT];
    for step in 0.. {
        let row = step * ROWS_PER_BEAT / steps_per_beat;
        if timing.seconds_at(Row(row).beat()) > SECONDS - 2.0 {
            break;
        }
        for _ in 0..1 + random.below(3) / 2 {
            let lane = Lane::ALL[random.below(Lane::COUNT)];
            if free[lane.index()] > row {
                continue;
            }
            let length = ROWS_PER_BEAT / steps_per_beat * (1 + random.below(4) as u32);
            let note = if random.unit() < 0.1 { Note::hold(Row(row), lane, length) } else { Note::tap(Row(row), lane) };
            free[lane.index()] = note.last_row().0 + 1;
            notes.push(note);
        }
    }
    StepChart::new(difficulty, 5, notes).expect("no notes overlap")
}

/// Dances a chart and measures how long each frame takes.
fn dance(chart: &StepChart, timing: &Timing, spread: f64, seed: u64, frame_seconds: f64) -> (Dance, Vec<Duration>) {
    let windows = TimingWindows::default();
    let player = DemoPlayer::new(chart, timing, windows, spread, seed);
    let (mut judge, mut tally) = (Judge::new(chart, timing, windows), Tally::new(chart));
    let (mut errors, mut unwanted_steps, mut times) = (Vec::new(), 0, Vec::new());
    let mut last_seconds = -1.0;
    for frame in 1..=(SECONDS / frame_seconds) as u32 {
        let seconds = f64::from(frame) * frame_seconds;
        let start = Instant::now();
        for Step { seconds, lane, kind } in player.steps(last_seconds, seconds) {
            for event in judge.advance(*seconds) {
                tally.count_event(event);
            }
            match kind {
                StepKind::Press => match judge.press(*lane, *seconds) {
                    Some(verdict) => {
                        tally.count_step(&verdict);
                        errors.push(verdict.error_seconds);
                    }
                    None => unwanted_steps += 1,
                },
                StepKind::Release => judge.release(*lane, *seconds),
            }
        }
        for event in judge.advance(seconds) {
            tally.count_event(event);
        }
        times.push(start.elapsed());
        last_seconds = seconds;
    }
    (Dance { tally, errors, unwanted_steps, is_finished: judge.is_finished() }, times)
}

fn charts(timing: &Timing) -> [StepChart; 3] {
    [(Difficulty::Easy, 1), (Difficulty::Medium, 2), (Difficulty::Hard, 4)]
        .map(|(difficulty, steps_per_beat)| chart(difficulty, steps_per_beat, timing))
}

#[test]
fn the_demo_player_drops_no_arrow_in_a_minute() {
    let timing = timing();
    for chart in charts(&timing) {
        for seed in SEEDS {
            let (dance, mut times) =
                dance(&chart, &timing, DemoPlayer::GOOD_SPREAD_SECONDS, seed, 1.0 / FRAMES_PER_SECOND);
            let tally = &dance.tally;
            let count = chart.notes().len();
            assert!(dance.is_finished);
            assert_eq!((tally.hits(Grade::Miss), dance.errors.len(), dance.unwanted_steps), (0, count, 0));
            assert_eq!(tally.holds(), (chart.holds() as u32, 0));
            if seed == 0 {
                times.sort_unstable();
                let [median, worst] = [times[times.len() / 2], times[times.len() - 1]];
                println!(
                    "{:?}: {count} notes, {} holds, {} {}, combo {}, hits {:?}, a frame {median:?} (worst {worst:?})",
                    chart.difficulty,
                    chart.holds(),
                    tally.score_text(),
                    tally.letter().name(),
                    tally.best_combo(),
                    Grade::ALL.map(|grade| tally.hits(grade)),
                );
            }
        }
    }
}

#[test]
fn equal_dances_are_equal_at_all_frame_rates() {
    let timing = timing();
    for chart in charts(&timing) {
        let dance = |seed, rate: f64| dance(&chart, &timing, 0.03, seed, 1.0 / rate).0;
        let first = dance(1, FRAMES_PER_SECOND);
        assert_eq!(first, dance(1, FRAMES_PER_SECOND));
        assert_eq!(first, dance(1, 7.0));
        assert_ne!(first.errors, dance(2, FRAMES_PER_SECOND).errors);
    }
}

#[test]
fn the_demo_player_is_as_uneven_as_it_is_told() {
    let timing = timing();
    let [chart, ..] = charts(&timing);
    for spread in [0.0, 0.009, 0.018] {
        let errors: Vec<f64> =
            (0..40).flat_map(|seed| dance(&chart, &timing, spread, seed, 1.0 / 60.0).0.errors).collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let deviation = (errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / errors.len() as f64).sqrt();
        // The feet of a jump differ a little, which adds 2 %.
        assert!((deviation - spread).abs() <= 0.08 * spread + 1e-9, "{deviation} instead of {spread}");
        assert!(mean.abs() <= 0.1 * spread + 1e-9, "{mean}");
    }
}

#[test]
fn even_a_bad_player_misses_nothing() {
    let timing = timing();
    for chart in charts(&timing) {
        let (dance, _) = dance(&chart, &timing, 0.5, 3, 1.0 / FRAMES_PER_SECOND);
        assert_eq!((dance.tally.hits(Grade::Miss), dance.unwanted_steps, dance.is_finished), (0, 0, true));
    }
}

#[test]
fn nobody_dances_where_nobody_steps() {
    let timing = timing();
    let [chart, ..] = charts(&timing);
    let mut judge = Judge::new(&chart, &timing, TimingWindows::default());
    let events = judge.advance(SECONDS);
    assert!(events.iter().all(|event| event.kind == JudgeEventKind::Missed));
    assert_eq!(events.len(), chart.notes().len());
    assert!(judge.is_finished());
}
