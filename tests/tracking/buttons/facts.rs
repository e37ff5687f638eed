//! What buttons notice and what they do not, over minutes of rendered feeds.

use super::{
    feed::{Feed, Sensed},
    hands::{Cover, Tap},
    lighting::Lighting,
    random::Random,
    score::{Score, spread},
    sheet_view::SheetView,
};
use glam::Vec2;

const SKINS: [Cover; 2] = [Cover::LIGHT_SKIN, Cover::DARK_SKIN];
/// Width of most frames in pixels: what is hardest to see.
const WIDTH: f32 = 320.0;

/// A feed in which lamps go on and off, people walk by and the exposure follows.
fn restless(seconds: f64, seed: u64) -> Feed {
    let mut feed = Feed::new(SheetView::usual(WIDTH), seed);
    feed.lighting = Lighting::restless(seconds, &mut Random::new(seed + 100));
    feed.is_exposure_automatic = true;
    feed
}

fn changes(sensed: &[Sensed]) -> usize {
    sensed.iter().flat_map(|frame| frame.changes).flatten().count()
}

/// Share of readings that could not tell.
fn unknown(sensed: &[Sensed]) -> f64 {
    let coverages = sensed.iter().flat_map(|frame| frame.coverage);
    coverages.filter(Option::is_none).count() as f64 / (4 * sensed.len()) as f64
}

fn score(feed: &mut Feed, seconds: f64) -> Score {
    let sensed = feed.run(seconds);
    Score::of(&feed.renderer.view, &feed.taps, &sensed)
}

#[test]
fn steps_are_found_while_the_light_changes() {
    const SECONDS: f64 = 120.0;
    let mut feed = restless(SECONDS, 2);
    feed.tap(SECONDS, &SKINS);
    let score = score(&mut feed, SECONDS);
    let (mean, deviation, worst) = spread(&score.errors);
    println!(
        "{} taps, found {:.4}, {} invented; late by {mean:.4} s, deviation {deviation:.4} s, worst {worst:.4} s",
        score.taps,
        score.found_fraction(),
        score.invented
    );
    assert!(score.taps > 200 && score.found_fraction() >= 0.98, "{:?}", score.faults);
    assert!(score.invented <= 2, "{:?}", score.faults);
    // A third of the time between frames.
    assert!(mean.abs() < 0.015 && deviation < 0.010, "late by {mean} ± {deviation} s");
}

#[test]
fn light_alone_is_no_step() {
    const SECONDS: f64 = 180.0;
    let sensed = restless(SECONDS, 3).run(SECONDS);
    assert_eq!(changes(&sensed), 0);
    assert!(unknown(&sensed) < 0.05, "{}", unknown(&sensed));
}

#[test]
fn gloves_shoes_and_dark_skin_are_seen() {
    for cover in [Cover::BLACK_GLOVE, Cover::BLACK_SHOE, Cover::DARK_SKIN] {
        let mut feed = restless(30.0, 5);
        feed.tap(30.0, &[cover]);
        let score = score(&mut feed, 30.0);
        assert!(score.taps > 20 && score.found_fraction() >= 0.95, "{cover:?}: {:?}", score.faults);
    }
}

#[test]
fn blur_and_compression_hide_no_steps() {
    const SECONDS: f64 = 15.0;
    for blur in [Vec2::splat(1.25), Vec2::new(2.0, 0.5)] {
        let mut feed = Feed::new(SheetView::usual(2.0 * WIDTH), 3);
        feed.lighting = Lighting::restless(SECONDS, &mut Random::new(3));
        feed.is_exposure_automatic = true;
        feed.sensor.blur = blur;
        feed.jpeg_quality = Some(80);
        feed.tap(SECONDS, &SKINS);
        let score = score(&mut feed, SECONDS);
        assert!(score.found_fraction() >= 0.95, "{blur}: {:?}", score.faults);
        assert!(score.invented <= 1, "{blur}: {:?}", score.faults);
    }
}

#[test]
fn in_the_dark_and_in_full_overexposure_nothing_is_known_and_nothing_steps() {
    for exposure in [0.004, 60.0] {
        let mut feed = restless(10.0, 7);
        feed.is_exposure_automatic = false;
        feed.sensor.exposure = exposure;
        feed.tap(10.0, &SKINS);
        let sensed = feed.run(10.0);
        assert_eq!(changes(&sensed), 0, "at exposure {exposure}");
        assert!(unknown(&sensed) > 0.95, "at exposure {exposure}: {}", unknown(&sensed));
    }
}

#[test]
fn a_button_that_is_covered_from_the_first_frame_on_steps_when_it_is_free_and_pressed_again() {
    let mut feed = Feed::new(SheetView::usual(WIDTH), 1);
    feed.taps.push(Tap::at(1, Vec2::ZERO, -0.2, Cover::LIGHT_SKIN));
    let end = feed.taps[0].end();
    feed.taps.push(Tap::at(1, Vec2::ZERO, end + 0.2, Cover::LIGHT_SKIN));
    let sensed = feed.run(end + 0.5);
    let first = sensed[0].coverage[1].expect("is seen");
    assert!(first > 0.1, "{first}");
    let of_field: Vec<bool> =
        sensed.iter().filter_map(|frame| frame.changes[1]).map(|change| change.is_covered).collect();
    assert_eq!(of_field[..2], [false, true]);
}

#[test]
fn where_dots_are_too_small_or_out_of_the_frame_nothing_is_known() {
    for (distance, is_known) in [(0.636, true), (4.0, false)] {
        let sensed = Feed::new(SheetView::around(WIDTH, distance, 45.0, 0.0), 1).run(0.5);
        assert_eq!(unknown(&sensed) < 0.1, is_known, "{distance} m");
    }
    let sensed = Feed::new(SheetView::usual(WIDTH).turned(Vec2::new(90.0, 0.0)), 1).run(0.5);
    let knows = sensed[5].coverage.map(|coverage| coverage.is_some());
    assert!(knows.contains(&true) && knows.contains(&false), "{knows:?}");
}
