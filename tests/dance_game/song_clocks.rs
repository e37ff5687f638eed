//! The song's clock against simulated audio devices.

use super::audio_device::{Device, FRAME, QUIET, Song};
use crate::random::Random;
use crate::rules::SongClock;

const WARM_UP_SECONDS: f64 = 3.0;
const SEEDS: std::ops::Range<u64> = 0..10;
/// How exactly arrows arrive on the beat that is heard.
const MAX_ERROR_SECONDS: f64 = 0.002;
/// What is as good as no error after a stall.
const RECOVERED_SECONDS: f64 = 0.01;
const RECOVERY_SECONDS: f64 = 0.5;

/// Returns mean, root mean square and largest error of the clock in a minute after it has warmed up.
fn errors(device: Device, seed: u64, frame_seconds: f64) -> [f64; 3] {
    let mut song = Song::new(device, seed, frame_seconds);
    song.run(WARM_UP_SECONDS);
    let (mut count, mut sum, mut squares, mut largest) = (0.0, 0.0, 0.0, 0.0_f64);
    while song.time < WARM_UP_SECONDS + 60.0 {
        let error = song.frame();
        count += 1.0;
        sum += error;
        squares += error * error;
        largest = largest.max(error.abs());
    }
    [sum / count, (squares / count).sqrt(), largest]
}

/// Returns when the clock is right again and stays so for a second, in seconds from now.
fn recovery(song: &mut Song) -> f64 {
    let start = song.time;
    let mut recovered = start;
    while song.time < start + RECOVERY_SECONDS + 1.0 {
        if song.frame().abs() > RECOVERED_SECONDS {
            recovered = song.time;
        }
    }
    recovered - start
}

#[test]
fn arrows_arrive_within_two_milliseconds_of_what_is_heard() {
    let noisy = Device { noise: 0.004, drift: 200e-6, ..QUIET };
    let mut late = Vec::new();
    for is_noise_of_block in [true, false] {
        for blocks in [[0.010; 2], [0.0145; 2], [0.0213; 2], [0.023; 2], [0.010, 0.023]] {
            for drift in [200e-6, -200e-6] {
                let device = Device { blocks, is_noise_of_block, drift, ..noisy };
                let all: Vec<_> = SEEDS.map(|seed| errors(device, seed, FRAME)).collect();
                let worst = all.iter().fold(0.0_f64, |worst, [.., largest]| worst.max(*largest));
                let mean = all.iter().map(|[mean, ..]| mean).sum::<f64>() / all.len() as f64;
                let square = all.iter().map(|[_, square, _]| square).fold(0.0, |worst, square| square.max(worst));
                println!(
                    "blocks {:.1} to {:.1} ms, noise of {}, drift {:+.0} ppm: mean {:+.2} ms, RMS of the worst seed \
                     {:.2} ms, largest {:.2} ms",
                    1e3 * blocks[0],
                    1e3 * blocks[1],
                    if is_noise_of_block { "block" } else { "report" },
                    1e6 * drift,
                    1e3 * mean,
                    1e3 * square,
                    1e3 * worst,
                );
                if worst > MAX_ERROR_SECONDS {
                    late.push(device);
                }
            }
        }
    }
    assert!(late.is_empty(), "{late:#?}");
}

#[test]
fn the_clock_is_as_exact_at_other_frame_rates_and_without_noise() {
    for rate in [30.0, 60.0, 72.0, 144.0, 240.0] {
        for noise in [0.0, 0.004] {
            let device = Device { blocks: [0.0116, 0.0213], noise, drift: 50e-6, ..QUIET };
            let all: Vec<_> = (0..5).map(|seed| errors(device, seed, 1.0 / rate)).collect();
            let worst = all.iter().fold(0.0_f64, |worst, [.., largest]| worst.max(*largest));
            println!("{rate} frames a second, noise {noise}: largest {:.2} ms", 1e3 * worst);
            // Without noise the usual one is taken off all the same.
            assert!(worst < 1.5 * MAX_ERROR_SECONDS, "{rate} frames a second, noise {noise}: {worst}");
        }
    }
}

#[test]
fn a_silent_song_follows_the_wall_clock() {
    let mut clock = SongClock::starting_at(-2.0);
    for _ in 0..300 {
        clock.advance(FRAME, None);
    }
    assert!((clock.seconds() - 3.0).abs() < 1e-9, "{}", clock.seconds());
}

#[test]
fn a_paused_song_stands_still() {
    let mut song = Song::new(QUIET, 1, FRAME);
    song.run(WARM_UP_SECONDS);
    let before = song.clock.seconds();
    song.clock.set_paused(true);
    assert!(song.clock.is_paused());
    let position = song.playback.position();
    for _ in 0..500 {
        assert_eq!(song.clock.advance(FRAME, Some(position)), before);
    }
    song.clock.set_paused(false);
    assert!(recovery(&mut song) < 2.0 * FRAME);
    assert!(song.clock.seconds() > before);
}

#[test]
fn audio_that_starts_late_is_met_without_a_jump() {
    // The audio has been told to start at 0, and is heard a moment later.
    let mut song = Song::new(QUIET, 2, FRAME);
    song.clock = SongClock::starting_at(-1.0);
    for _ in 0..60 {
        song.clock.advance(FRAME, None);
    }
    song.stall(0.2);
    // The clock went on for a moment only.
    assert!(song.clock.seconds() < 0.12, "{}", song.clock.seconds());
    assert!(recovery(&mut song) < RECOVERY_SECONDS);
}

#[test]
fn a_stall_of_the_audio_is_made_up_within_half_a_second() {
    let noisy = Device { noise: 0.004, ..QUIET };
    for device in [QUIET, noisy, Device { is_noise_of_block: false, ..noisy }] {
        for seed in 0..10 {
            for stall in [0.05, 0.1, 0.2, 0.5, 1.0, 5.0] {
                let mut song = Song::new(device, seed, FRAME);
                song.run(WARM_UP_SECONDS);
                let before = song.clock.seconds();
                song.stall(stall);
                assert!(song.clock.seconds() - before < stall.min(0.1) + 2.0 * FRAME);
                let recovery = recovery(&mut song);
                assert!(recovery < RECOVERY_SECONDS, "{device:?}, stall of {stall} s: {recovery} s");
            }
        }
    }
}

#[test]
fn audio_that_was_moved_is_followed() {
    for seconds in [-20.0, -0.6, 0.6, 45.0] {
        let mut song = Song::new(QUIET, 4, FRAME);
        song.run(30.0);
        let target = song.playback.heard + seconds;
        song.playback.move_to(target);
        let mut frames = 0;
        while (song.clock.seconds() - song.playback.heard).abs() > RECOVERED_SECONDS {
            frames += 1;
            assert!(f64::from(frames) * FRAME < RECOVERY_SECONDS, "moved by {seconds} s");
            song.time += FRAME;
            song.playback.play(FRAME);
            let position = song.playback.position();
            song.clock.advance(FRAME, Some(position));
        }
    }
}

#[test]
fn errors_under_half_a_second_are_made_up_without_a_jump() {
    for seconds in [-0.45, -0.2, 0.2, 0.45] {
        let mut song = Song::new(QUIET, 5, FRAME);
        song.run(10.0);
        let target = song.playback.heard + seconds;
        song.playback.move_to(target);
        let mut last = song.clock.seconds();
        while song.time < 12.0 {
            song.frame();
            let step = song.clock.seconds() - last;
            assert!((0.0..=0.06).contains(&step), "a frame of {step} s");
            last = song.clock.seconds();
        }
        assert!((last - song.playback.heard).abs() < RECOVERED_SECONDS, "moved by {seconds} s");
    }
}

#[test]
fn a_long_frame_is_no_stall() {
    let mut song = Song::new(QUIET, 6, FRAME);
    song.run(WARM_UP_SECONDS);
    for delta in [0.3, 0.9, 2.0] {
        song.playback.play(delta);
        let position = song.playback.position();
        let now = song.clock.advance(delta, Some(position));
        assert!((now - song.playback.heard).abs() < RECOVERED_SECONDS, "after a frame of {delta} s");
    }
}

#[test]
fn what_is_not_finite_does_not_reach_the_song() {
    let mut song = Song::new(QUIET, 7, FRAME);
    song.run(WARM_UP_SECONDS);
    let before = song.clock.seconds();
    for (delta, position) in [(f64::NAN, None), (f64::INFINITY, Some(f64::NAN)), (-1.0, Some(f64::INFINITY))] {
        assert_eq!(song.clock.advance(delta, position), before);
    }
    assert!(recovery(&mut song) < 2.0 * FRAME);
}

#[test]
fn the_song_runs_evenly() {
    for is_noise_of_block in [true, false] {
        let device = Device { noise: 0.004, blocks: [0.010, 0.023], is_noise_of_block, drift: 200e-6 };
        let mut song = Song::new(device, 8, FRAME);
        song.run(WARM_UP_SECONDS);
        let mut largest = 0.0_f64;
        while song.time < 30.0 {
            let (time, seconds) = (song.time, song.clock.seconds());
            song.frame();
            let rate = (song.clock.seconds() - seconds) / (song.time - time);
            largest = largest.max((rate - 1.0).abs());
        }
        assert!(largest < 0.02, "the rate is off by {largest}");
    }
}

#[test]
fn no_time_and_no_position_break_the_clock() {
    let extremes = [0.0, 1e-300, 0.01, -3.0, 1e9, f64::MAX, f64::MIN, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
    let mut random = Random::new(9);
    let mut clock = SongClock::starting_at(0.0);
    for _ in 0..20_000 {
        let delta = extremes[random.below(extremes.len())];
        let position = extremes[random.below(extremes.len())];
        let now = clock.advance(delta, (random.unit() < 0.8).then_some(position));
        assert!(now.is_finite(), "{now} after {delta} s at {position}");
    }
}
