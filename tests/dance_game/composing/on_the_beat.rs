//! Arrows are where beats are known to be.

use crate::{
    composer::{Composition, Sound, compose, onsets::OnsetStrength, spectrum::Spectra},
    composing::synthetic_track::{Drum, Track},
    composing::ten_tracks::{Composed, TEN_SONGS, rock},
    song::{Difficulty, StepChart},
};

/// A press within 22.5 ms has the best grade, so arrows have to be well within.
const ON_BEAT_SECONDS: f64 = 0.020;
/// Of the tempo, one half or twice of it.
const TEMPO_TOLERANCE: f64 = 0.005;
/// A drum is heard as one with the beat within a few milliseconds.
const ONSET_SECONDS: f64 = 0.005;

fn composed(track: &Track) -> Composition {
    compose(&track.sound(), 1).expect("the track has a beat")
}

fn nearest(times: &[f64], seconds: f64) -> f64 {
    times.iter().map(|time| (time - seconds).abs()).fold(f64::INFINITY, f64::min)
}

/// Fraction of the arrows of all charts that are on one of these times.
fn fraction_on(times: &[f64], song: &Composition) -> f64 {
    let notes = song.charts.iter().flat_map(StepChart::notes);
    let arrows: Vec<f64> = notes.map(|note| song.timing.seconds_at(note.beat())).collect();
    arrows.iter().filter(|arrow| nearest(times, **arrow) < ON_BEAT_SECONDS).count() as f64 / arrows.len() as f64
}

#[test]
fn arrows_of_ten_tracks_are_on_beats_and_half_beats() {
    for Composed { name, track, song } in &*TEN_SONGS {
        let fraction = fraction_on(&track.grid(2), song);
        println!("{name}: {:.1} % on the beat, {:?}", 100.0 * fraction, song.timing.tempos().collect::<Vec<_>>());
        // Syncopation is asked for where it sounds, on quarter beats.
        let grid = if name.starts_with("syncopation") { 4 } else { 2 };
        assert!(fraction_on(&track.grid(grid), song) >= 0.95, "{name}: {fraction}");
        assert!(fraction >= 0.75, "{name}: {fraction}");
    }
}

#[test]
fn tempos_of_ten_tracks_are_found() {
    for Composed { name, track, song } in &*TEN_SONGS {
        for beat in [8, track.beats.len() - 9] {
            let truth = 60.0 / (track.beats[beat + 1] - track.beats[beat]);
            let found = song.timing.bpm_at(song.timing.beat_at(track.beats[beat] + 0.01));
            let error = [0.5, 1.0, 2.0].map(|level| (found / (level * truth) - 1.0).abs());
            assert!(error.into_iter().fold(1.0, f64::min) < TEMPO_TOLERANCE, "{name}: {found} for {truth}");
        }
    }
}

#[test]
fn a_constant_tempo_is_one_tempo_and_a_change_is_two() {
    for Composed { name, song, .. } in &*TEN_SONGS {
        let expected = if name.contains("then") { 2 } else { 1 };
        assert_eq!(song.timing.tempos().count(), expected, "{name}");
    }
}

#[test]
fn a_whole_tempo_is_exact() {
    let song = composed(&rock(Track::with_tempo(44_100, 30.0, 0.5, 120.0)));
    assert_eq!(song.timing.tempos().collect::<Vec<_>>(), [(0.0, 120.0)]);
}

#[test]
fn onsets_are_where_sounds_begin() {
    type Play = fn(&mut Track, f64);
    let instruments: [(&str, Play); 5] = [
        ("bass drum", |track, start| track.drum(Drum::Bass, start, 1.0)),
        ("snare", |track, start| track.drum(Drum::Snare, start, 1.0)),
        ("hi-hat", |track, start| track.drum(Drum::HiHat, start, 1.0)),
        ("quiet hi-hat", |track, start| track.drum(Drum::HiHat, start, 0.05)),
        ("tone", |track, start| track.tone(start, 0.4, 330.0, 0.002, 1.0)),
    ];
    for rate in [22_050, 44_100, 48_000] {
        for (name, play) in instruments {
            let mut track = Track::with_tempo(rate, 20.0, 0.4, 113.0);
            for start in track.beats.clone() {
                play(&mut track, start);
            }
            let spectra = Spectra::of(&track.sound());
            let onsets: Vec<f64> =
                OnsetStrength::of(&spectra).onsets(&spectra).iter().map(|onset| onset.seconds).collect();
            let worst = track.beats.iter().map(|beat| nearest(&onsets, *beat)).fold(0.0, f64::max);
            assert!(worst < ONSET_SECONDS, "{name} at {rate} Hz: {worst} s");
        }
    }
}

#[test]
fn beat_zero_begins_a_measure() {
    let track = rock(Track::with_tempo(44_100, 60.0, 1.7, 120.0));
    let first = composed(&track).timing.beat_at(track.beats[0]);
    assert!((first / 4.0 - (first / 4.0).round()).abs() < 0.01, "the first beat is beat {first}");
}

#[test]
fn arrows_between_beats_have_a_sound() {
    // No sound is between the beats of this one.
    let mut track = Track::with_tempo(44_100, 40.0, 0.5, 118.0);
    for beat in track.beats.clone() {
        track.drum(Drum::Snare, beat, 0.8);
    }
    let song = composed(&track);
    assert_eq!(song.charts.len(), Difficulty::ALL.len());
    assert_eq!(fraction_on(&track.grid(1), &song), 1.0);
}

#[test]
fn what_has_no_beat_has_no_charts() {
    let silence = Sound { samples: vec![0.0; 441_000], rate: 44_100 };
    let nothing = Sound { samples: Vec::new(), rate: 44_100 };
    let click = Sound { samples: vec![1.0], rate: 44_100 };
    let mut noise = Track::new(44_100, 20.0);
    noise.tone(0.0, 0.1, 440.0, 0.01, 0.1);
    noise.add_noise(1e6);
    let mut random = Track::new(44_100, 40.0);
    let mut time = 0.5;
    while time < 39.0 {
        random.drum(Drum::Snare, time, 0.7);
        time += 0.4 + 0.35 * f64::from(random.white());
    }
    for sound in [silence, nothing, click, noise.sound(), random.sound()] {
        let error = compose(&sound, 1).expect_err("there is no beat").to_string();
        assert!(error.starts_with("no beat can be found"), "{error}");
    }
}
