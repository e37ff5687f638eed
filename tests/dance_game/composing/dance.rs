//! Charts can be danced: feet alternate, silence rests, and repeated music has repeated steps.

use crate::{
    composer::{Composition, compose},
    composing::synthetic_track::{Drum, Track},
    composing::ten_tracks::{Composed, TEN_SONGS, rock},
    song::{Difficulty, Lane, Note, ROWS_PER_BEAT, StepChart},
};
use std::collections::BTreeMap;

const ROWS_PER_PHRASE: u32 = 16 * ROWS_PER_BEAT;

fn composed(track: &Track) -> Composition {
    compose(&track.sound(), 1).expect("the track has a beat")
}

fn chart(song: &Composition, difficulty: Difficulty) -> &StepChart {
    song.charts.iter().find(|chart| chart.difficulty == difficulty).expect("all difficulties are composed")
}

/// Lanes of each row, in order.
fn rows(chart: &StepChart) -> Vec<(u32, Vec<Lane>)> {
    let mut rows: BTreeMap<u32, Vec<Lane>> = BTreeMap::new();
    for note in chart.notes() {
        rows.entry(note.row.0).or_default().push(note.lane);
    }
    rows.into_iter().collect()
}

/// Entropy in bits of how often things occur.
fn entropy<T: Ord>(things: impl IntoIterator<Item = T>) -> f64 {
    let mut counts: BTreeMap<T, f64> = BTreeMap::new();
    for thing in things {
        *counts.entry(thing).or_default() += 1.0;
    }
    let all: f64 = counts.values().sum();
    counts.values().map(|count| -count / all * (count / all).log2()).sum()
}

/// Verse of drums, chorus of drums and tones, silence, verse, chorus; four measures each.
fn song_of_parts() -> Track {
    let mut track = Track::with_tempo(44_100, 42.0, 0.5, 120.0);
    track.beats.truncate(80);
    for beat in 0..80 {
        let (part, half) = (beat / 16, track.at(beat, 0.5));
        if part == 2 {
            continue;
        }
        track.drum(if beat % 2 == 0 { Drum::Bass } else { Drum::Snare }, track.beats[beat], 0.5);
        if part % 3 == 1 {
            track.drum(Drum::HiHat, half, 0.8);
            track.tone(track.beats[beat], 0.4, [110.0, 147.0, 165.0, 147.0][beat % 4], 0.004, 0.6);
            track.tone(half, 0.2, 440.0, 0.004, 0.6);
        }
    }
    track
}

#[test]
fn difficulties_rise() {
    for Composed { name, song, .. } in &*TEN_SONGS {
        let [easy, medium, hard] = Difficulty::ALL.map(|difficulty| chart(song, difficulty));
        assert!(easy.notes().len() <= medium.notes().len(), "{name}");
        assert!(medium.notes().len() <= hard.notes().len(), "{name}");
        assert!(easy.meter < medium.meter && medium.meter < hard.meter, "{name}");
    }
}

#[test]
fn easy_has_beats_only_and_medium_half_beats_too() {
    for Composed { name, song, .. } in &*TEN_SONGS {
        for (difficulty, step) in Difficulty::ALL.into_iter().zip([ROWS_PER_BEAT, ROWS_PER_BEAT / 2, ROWS_PER_BEAT / 4])
        {
            let is_on = |note: &Note| note.row.0.is_multiple_of(step);
            assert!(chart(song, difficulty).notes().iter().all(is_on), "{name} {}", difficulty.name());
        }
    }
}

#[test]
fn neighboring_steps_are_in_different_lanes() {
    for Composed { name, song, .. } in &*TEN_SONGS {
        for chart in &song.charts {
            for pair in rows(chart).windows(2) {
                let [(_, before), (row, after)] = pair else { continue };
                let is_jack = before.len() == 1 && before == after;
                assert!(!is_jack, "{name} {}: row {row} repeats a lane", chart.difficulty.name());
            }
        }
    }
}

#[test]
fn feet_alternate_without_crossing() {
    for Composed { name, song, .. } in &*TEN_SONGS {
        for difficulty in [Difficulty::Easy, Difficulty::Medium] {
            // After a jump either foot may go on.
            let singles = rows(chart(song, difficulty));
            for run in singles.split(|(_, lanes)| lanes.len() > 1) {
                let lanes: Vec<Lane> = run.iter().map(|(_, lanes)| lanes[0]).collect();
                let crosses = |left_first: usize| {
                    lanes.iter().enumerate().any(|(i, lane)| match lane {
                        Lane::Left => i % 2 != left_first,
                        Lane::Right => i % 2 == left_first,
                        Lane::Up | Lane::Down => false,
                    })
                };
                assert!(!crosses(0) || !crosses(1), "{name} {}: {lanes:?}", difficulty.name());
            }
        }
    }
}

#[test]
fn all_lanes_are_danced_in_many_orders() {
    for Composed { name, song, .. } in &*TEN_SONGS {
        for chart in &song.charts {
            let lanes: Vec<Lane> = chart.notes().iter().map(|note| note.lane).collect();
            let single = entropy(lanes.iter().copied());
            let pairs = entropy(lanes.windows(2).map(|pair| (pair[0], pair[1])));
            // Of 2 and 4 bits; feet that alternate leave about 3 of the latter.
            assert!(single > 1.85, "{name} {}: {single} bits", chart.difficulty.name());
            assert!(pairs > 2.6, "{name} {}: {pairs} bits", chart.difficulty.name());
        }
    }
}

#[test]
fn jumps_are_for_those_who_want_them() {
    let song = &composed(&song_of_parts());
    let jumps = |difficulty| rows(chart(song, difficulty)).iter().filter(|(_, lanes)| lanes.len() > 1).count();
    assert_eq!(jumps(Difficulty::Easy), 0);
    assert!(jumps(Difficulty::Medium) > 0);
    assert!(jumps(Difficulty::Hard) > jumps(Difficulty::Medium));
}

#[test]
fn silence_has_no_arrows() {
    let track = song_of_parts();
    let song = composed(&track);
    let silence = track.beats[32] + 0.3..track.beats[48] - 0.1;
    for chart in &song.charts {
        let is_silent = |note: &Note| silence.contains(&song.timing.seconds_at(note.beat()));
        assert!(!chart.notes().iter().any(is_silent), "{}", chart.difficulty.name());
        assert!(chart.notes().iter().any(|note| song.timing.seconds_at(note.beat()) > silence.end));
    }
}

#[test]
fn a_chorus_has_more_arrows_than_a_verse() {
    let track = song_of_parts();
    let song = composed(&track);
    for chart in &song.charts {
        let count = |part: usize| {
            let range = track.beats[16 * part] - 0.1..track.beats[16 * part + 15] + 0.4;
            chart.notes().iter().filter(|note| range.contains(&song.timing.seconds_at(note.beat()))).count()
        };
        let name = chart.difficulty.name();
        assert!(4 * count(1) >= 5 * count(0), "{name}: {} in the verse, {} in the chorus", count(0), count(1));
        assert!(4 * count(4) >= 5 * count(3), "{name}: {} in the verse, {} in the chorus", count(3), count(4));
    }
}

#[test]
fn repeated_music_has_repeated_steps() {
    let song = composed(&song_of_parts());
    for chart in &song.charts {
        // Mirrored or not, steps of one lane stay steps of one lane.
        let phrase = |part: u32| -> Vec<(u32, bool)> {
            let range = part * ROWS_PER_PHRASE..(part + 1) * ROWS_PER_PHRASE;
            let notes = chart.notes().iter().filter(|note| range.contains(&note.row.0));
            let is_aside = |lane| matches!(lane, Lane::Left | Lane::Right);
            let mut steps: Vec<_> = notes.map(|note| (note.row.0 - range.start, is_aside(note.lane))).collect();
            steps.sort_unstable();
            steps
        };
        assert_eq!(phrase(1), phrase(4), "{}", chart.difficulty.name());
    }
}

#[test]
fn long_notes_are_held() {
    let mut track = Track::with_tempo(44_100, 60.0, 0.5, 120.0);
    for beat in 0..track.beats.len() {
        // Two measures of drums, then two long tones.
        if beat % 16 < 8 {
            track.drum(if beat % 2 == 0 { Drum::Bass } else { Drum::Snare }, track.beats[beat], 0.7);
            track.drum(Drum::HiHat, track.at(beat, 0.5), 0.4);
        } else if beat % 4 == 0 {
            track.tone(track.beats[beat], 1.9, 220.0, 0.004, 1.0);
        }
    }
    let song = composed(&track);
    assert_eq!(chart(&song, Difficulty::Easy).holds(), 0);
    assert!(chart(&song, Difficulty::Hard).holds() >= 4);
    for note in chart(&song, Difficulty::Hard).notes().iter().filter(|note| note.length_rows.is_some()) {
        let start = song.timing.seconds_at(note.beat());
        let is_tone = (8..track.beats.len()).any(|beat| beat % 16 >= 8 && (track.beats[beat] - start).abs() < 0.02);
        assert!(is_tone, "a hold at {start} s");
    }
}

#[test]
fn one_seed_has_one_chart_and_others_have_others() {
    let sound = rock(Track::with_tempo(44_100, 20.0, 0.5, 130.0)).sound();
    let lanes = |seed| -> Vec<Vec<Note>> {
        let song = compose(&sound, seed).expect("the track has a beat");
        song.charts.iter().map(|chart| chart.notes().to_vec()).collect()
    };
    assert_eq!(lanes(7), lanes(7));
    assert_ne!(lanes(7), lanes(8));
}
