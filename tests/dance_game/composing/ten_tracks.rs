//! Ten pieces of music of known beats: rock, house, swing, a change of tempo, noise, syncopation and a played piano.

use crate::{
    composer::{Composition, compose},
    composing::synthetic_track::{Drum, Track},
};
use std::sync::LazyLock;

/// A track and the charts that it gets.
pub(crate) struct Composed {
    pub name: &'static str,
    pub track: Track,
    pub song: Composition,
}

/// The ten tracks, composed once for all tests.
pub(crate) static TEN_SONGS: LazyLock<Vec<Composed>> = LazyLock::new(|| {
    let compose = |(name, track): (&'static str, Track)| {
        let song = compose(&track.sound(), 1).expect("the track has a beat");
        Composed { name, track, song }
    };
    ten_tracks().into_iter().map(compose).collect()
});

const RATE: u32 = 44_100;

fn ten_tracks() -> Vec<(&'static str, Track)> {
    let mut noisy = rock(Track::with_tempo(RATE, 50.0, 0.37, 110.0));
    noisy.add_noise(1.0);
    vec![
        ("rock 60", rock(Track::with_tempo(RATE, 60.0, 0.3, 60.0))),
        ("rock 93.7 at 48 kHz", rock(Track::with_tempo(48_000, 45.0, 0.21, 93.7))),
        ("rock 120 after 6.3 s of silence", rock(Track::with_tempo(RATE, 50.0, 6.3, 120.0))),
        ("rock 180", rock(Track::with_tempo(RATE, 40.0, 0.4, 180.0))),
        ("house 128", house()),
        ("swing 140", swing()),
        ("104, then 132", change_of_tempo()),
        ("rock 110 in noise of 0 dB", noisy),
        ("syncopation 100", syncopation()),
        ("piano 76, played", piano()),
    ]
}

/// Bass drum on 1 and 3, snare on 2 and 4, hi-hat on half beats, bass on beats.
pub(crate) fn rock(mut track: Track) -> Track {
    for beat in 0..track.beats.len() {
        let (start, half) = (track.beats[beat], track.at(beat, 0.5));
        track.drum(if beat % 2 == 0 { Drum::Bass } else { Drum::Snare }, start, 0.9);
        track.drum(Drum::HiHat, start, 0.5);
        track.drum(Drum::HiHat, half, 0.4);
        track.tone(start, 1.6 * (half - start), [55.0, 55.0, 82.4, 73.4][beat / 4 % 4], 0.005, 0.4);
    }
    track
}

/// Bass drum on every beat, and a loud hi-hat between.
fn house() -> Track {
    let mut track = Track::with_tempo(RATE, 60.0, 0.05, 128.0);
    for beat in 0..track.beats.len() {
        track.drum(Drum::Bass, track.beats[beat], 1.0);
        track.drum(Drum::HiHat, track.at(beat, 0.5), 1.0);
        if beat % 2 == 1 {
            track.drum(Drum::Snare, track.beats[beat], 0.5);
        }
        if beat % 4 == 3 {
            track.tone(track.at(beat, 0.25), 0.1, 440.0, 0.002, 0.4);
            track.tone(track.at(beat, 0.75), 0.1, 440.0, 0.002, 0.4);
        }
    }
    track
}

/// Cymbal on beats and the last third of every other, and a walking bass.
fn swing() -> Track {
    let mut track = Track::with_tempo(RATE, 45.0, 0.5, 140.0);
    for beat in 0..track.beats.len() {
        let start = track.beats[beat];
        track.drum(Drum::HiHat, start, if beat % 2 == 1 { 1.2 } else { 0.8 });
        if beat % 2 == 1 {
            track.drum(Drum::HiHat, track.at(beat, 2.0 / 3.0), 0.6);
        }
        track.tone(start, 0.35, [55.0, 61.7, 65.4, 73.4, 82.4, 77.8, 73.4, 61.7][beat % 8], 0.008, 0.7);
        if beat % 4 == 0 {
            track.drum(Drum::Bass, start, 0.3);
        }
    }
    track
}

/// Fourteen measures of one tempo, then another.
fn change_of_tempo() -> Track {
    let mut track = Track::new(RATE, 70.0);
    let next = track.add_beats(0.4, 0.4 + 55.5 * 60.0 / 104.0, 104.0);
    track.add_beats(next, 69.0, 132.0);
    rock(track)
}

/// Three, three and two quarter beats, with few drums.
fn syncopation() -> Track {
    let mut track = Track::with_tempo(RATE, 55.0, 0.6, 100.0);
    for beat in 0..track.beats.len() {
        if beat % 2 == 0 {
            for fraction in [0.0, 0.75, 1.5] {
                track.tone(track.at(beat, fraction), 0.25, 261.6, 0.004, 0.7);
                track.drum(Drum::HiHat, track.at(beat, fraction), 0.6);
            }
        }
        match beat % 4 {
            0 => track.drum(Drum::Bass, track.beats[beat], 0.9),
            2 => track.drum(Drum::Snare, track.beats[beat], 0.7),
            3 => track.drum(Drum::Bass, track.at(beat, 0.5), 0.7),
            _ => {}
        }
    }
    track
}

/// Soft tones up to 8 ms early or late, without drums.
fn piano() -> Track {
    let mut track = Track::with_tempo(22_050, 60.0, 1.1, 76.0);
    for beat in 0..track.beats.len() {
        for (fraction, hertz, gain) in [(0.0, 220.0, 0.6), (0.5, 330.0, 0.35)] {
            let late = 0.008 * f64::from(track.white());
            let hertz = hertz * [1.0, 1.122, 1.335, 1.0][beat / 4 % 4];
            track.tone(track.at(beat, fraction) + late, 0.7, hertz, 0.012, gain);
        }
    }
    track
}
