//! The moves that the dancer makes of a chart.

use crate::{
    choreography::{Move, SLOTS, motions},
    song::{Difficulty, Lane, Note, ROWS_PER_BEAT, Row, StepChart},
};

fn chart(notes: &[(u32, Lane)]) -> StepChart {
    let notes = notes.iter().map(|(row, lane)| Note::tap(Row(*row), *lane)).collect();
    StepChart::new(Difficulty::Hard, 9, notes).expect("no notes overlap")
}

/// Quarters, eighths, sixteenths, a jump, one lane over and over, and a long rest.
fn dance() -> StepChart {
    let beat = ROWS_PER_BEAT;
    let mut notes = vec![(0, Lane::Left), (beat, Lane::Right)];
    notes.extend((0..8).map(|i| (2 * beat + i * beat / 2, Lane::ALL[i as usize % 4])));
    notes.extend((0..8).map(|i| (6 * beat + i * beat / 4, Lane::Up)));
    notes.extend([(9 * beat, Lane::Left), (9 * beat, Lane::Right), (16 * beat, Lane::Down)]);
    chart(&notes)
}

#[test]
fn weights_are_a_whole_pose_at_every_moment() {
    let chart = dance();
    for step in -100..2000 {
        let beat = f64::from(step) / 100.0;
        let motions = motions(&chart, beat, Some(12.5));
        let sum: f32 = motions.iter().map(|motion| motion.weight).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{sum} at beat {beat}");
        for (i, motion) in motions.iter().enumerate() {
            assert!((0.0..=1.0).contains(&motion.weight) && motion.slot < SLOTS);
            assert!((0.0..=motion.what.beats() as f32).contains(&motion.beats), "{motion:?}");
            let same = |other: &crate::choreography::Motion| (other.what, other.slot) == (motion.what, motion.slot);
            assert_eq!(
                motions.iter().position(same),
                Some(i),
                "one animation at two times at beat {beat}: {motions:?}"
            );
        }
    }
}

#[test]
fn every_foot_lands_on_the_beat_of_its_arrow() {
    let chart = dance();
    for note in chart.notes() {
        let landed = motions(&chart, note.beat(), None);
        let is_jump = chart.notes().iter().filter(|other| other.row == note.row).count() > 1;
        let expected = if is_jump { Move::Jump } else { Move::Step(note.lane) };
        let step = landed.iter().find(|motion| motion.what == expected && (motion.beats - 0.5).abs() < 1e-6);
        let step = step.unwrap_or_else(|| panic!("no {expected:?} lands at {}: {landed:?}", note.beat()));
        let heaviest = landed.iter().map(|motion| motion.weight).fold(0.0, f32::max);
        assert!(step.weight >= heaviest - 1e-6, "{landed:?}");
    }
}

#[test]
fn no_pose_jumps() {
    const STEP: f64 = 0.005;
    /// Quickest change of a weight: that of a spin's beginning.
    const MOST: f32 = 0.005 / 0.2 * 1.5;
    let chart = dance();
    let mut before = motions(&chart, -1.0, Some(12.5));
    for i in 1..4000 {
        let beat = -1.0 + f64::from(i) * STEP;
        let now = motions(&chart, beat, Some(12.5));
        for motion in &now {
            let same = |other: &&crate::choreography::Motion| (other.what, other.slot) == (motion.what, motion.slot);
            let last = before.iter().find(same);
            let change = motion.weight - last.map_or(0.0, |last| last.weight);
            assert!(change.abs() < MOST, "{motion:?} changes by {change} at beat {beat}");
            let advance = last.map_or(0.0, |last| (motion.beats - last.beats).rem_euclid(motion.what.beats() as f32));
            let is_new = motion.weight < MOST || last.is_none_or(|last| last.weight < MOST);
            assert!(is_new || (advance - STEP as f32).abs() < 1e-4, "{motion:?} leaps by {advance} at beat {beat}");
        }
        before = now;
    }
}

#[test]
fn a_long_rest_has_a_spin_and_a_miss_a_stumble() {
    let chart = dance();
    let has = |beat: f64, stumbled: Option<f64>, what: Move| {
        motions(&chart, beat, stumbled).iter().any(|motion| motion.what == what && motion.weight > 0.9)
    };
    assert!(has(10.6, None, Move::Spin) && !has(15.0, None, Move::Spin) && !has(5.2, None, Move::Spin));
    assert!(has(13.0, Some(12.6), Move::Stumble) && !has(13.0, None, Move::Stumble));
}
