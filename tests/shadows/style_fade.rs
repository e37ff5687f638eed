//! Crossfades between styles.

use crate::studio::{Picture, SIZE, Studio, checkers, normals};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_mirrorball::prelude::*;
use std::time::Duration;

/// Rounding to 8 bits of both pictures, and other samples of the dome's shadows in the transparent pass.
const MIXTURE_TOLERANCE: f32 = 0.015;
const SECONDS: f32 = 0.8;
/// Less than the longest step of the game's time.
const STEP: f32 = 0.2;

/// A ball under the sky whose style fades, while time stands still.
fn under_sky(style: SurfaceStyle) -> Option<Studio> {
    let mut studio = Studio::new(style)?;
    studio.add_sky(Vec3::new(0.6, 0.64, 0.48), Vec3::splat(0.1), Vec3::new(0.9, 0.7, 0.5));
    studio.app.world_mut().spawn(ShadowDomeLight { directions: 8, resolution: 32, surfels: 0, ..default() });
    studio.app.world_mut().entity_mut(studio.ball).insert(StyleFade { seconds: SECONDS });
    stop(&mut studio);
    // The caches of the dome fill.
    for _ in 0..4 {
        studio.shoot();
    }
    Some(studio)
}

fn stop(studio: &mut Studio) {
    studio.app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
}

/// Lets the game's time pass by one step, in one frame.
fn step(studio: &mut Studio) {
    studio.app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f32(STEP)));
    studio.app.update();
    stop(studio);
}

fn finish(studio: &mut Studio) {
    for _ in 0..5 {
        step(studio);
    }
}

/// Difference on the ball from the mixture of two pictures that three pixels in a hundred exceed: other samples move
/// the edges of toon bands by a pixel.
fn off_mixture(picture: &Picture, old: &Picture, new: &Picture, gone: f32) -> f32 {
    let differences = normals().map(|(pixel, _)| {
        let expected = old.linear(pixel).lerp(new.linear(pixel), gone);
        (picture.linear(pixel) - expected).abs().max_element()
    });
    let mut differences: Vec<f32> = differences.collect();
    differences.sort_by(f32::total_cmp);
    differences[differences.len() * 97 / 100]
}

/// Toon without an outline.
fn toon() -> SurfaceStyle {
    SurfaceStyle::Toon(ToonStyle { outline_width: 0.0, ..default() })
}

fn outlined() -> SurfaceStyle {
    SurfaceStyle::Toon(ToonStyle { outline_width: 6.0, outline_color: Color::linear_rgb(0.0, 1.0, 0.0), ..default() })
}

fn meshes(studio: &mut Studio) -> usize {
    studio.count::<Mesh3d>()
}

#[test]
fn a_fade_mixes_both_styles() {
    let classic = SurfaceStyle::Classic(ClassicStyle { model: ClassicModel::GlossMap, ..default() });
    for masked in [false, true] {
        let Some(mut studio) = under_sky(SurfaceStyle::ImageBased) else { return };
        let texture = checkers([255, 120, 60, 0], [255, 200, 100, 255]);
        let texture = studio.app.world_mut().resource_mut::<Assets<Image>>().add(texture);
        let alpha_mode = if masked { AlphaMode::Mask(0.5) } else { AlphaMode::Opaque };
        studio.set_ball(
            StandardMaterial { base_color_texture: Some(texture), alpha_mode, ..default() },
            SurfaceStyle::ImageBased,
        );
        studio.app.world_mut().entity_mut(studio.ball).insert(StyleFade { seconds: SECONDS });
        let mut old = studio.shoot();
        for style in [toon(), SurfaceStyle::Engine, classic, SurfaceStyle::ImageBased] {
            studio.set_style(style);
            let begun = studio.shoot();
            step(&mut studio);
            let quarter = studio.shoot();
            step(&mut studio);
            step(&mut studio);
            let three_quarters = studio.shoot();
            assert_eq!(meshes(&mut studio), 2);
            finish(&mut studio);
            let new = studio.shoot();
            assert_eq!(meshes(&mut studio), 1);
            let off = [
                off_mixture(&begun, &old, &new, 0.0),
                off_mixture(&quarter, &old, &new, 0.25),
                off_mixture(&three_quarters, &old, &new, 0.75),
            ];
            println!("masked {masked}, to {style:?}: off by {off:?}, {} apart", old.difference(&new));
            assert!(off.iter().all(|off| *off < MIXTURE_TOLERANCE));
            assert!(old.difference(&new) > 8, "or there would be nothing to fade");
            old = new;
        }
    }
}

#[test]
fn a_change_back_turns_the_fade_around() {
    let Some(mut studio) = under_sky(SurfaceStyle::ImageBased) else { return };
    let old = studio.shoot();
    studio.set_style(toon());
    step(&mut studio);
    step(&mut studio);
    let there = studio.shoot();
    studio.set_style(SurfaceStyle::ImageBased);
    let turned = studio.shoot();
    let off = off_mixture(&turned, &there, &there, 0.0);
    println!("turned: off by {off}");
    assert!(off < MIXTURE_TOLERANCE && there.difference(&old) > 10);
    assert_eq!(meshes(&mut studio), 2);
    step(&mut studio);
    let nearer = studio.shoot();
    assert!(nearer.difference(&old) < there.difference(&old));
    finish(&mut studio);
    assert_eq!((meshes(&mut studio), studio.shoot().difference(&old)), (1, 0));
    // A third style starts from the one that is faded in.
    for style in [toon(), SurfaceStyle::Engine, SurfaceStyle::Classic(default())] {
        studio.set_style(style);
        step(&mut studio);
        assert_eq!(meshes(&mut studio), 2);
    }
}

#[test]
fn outlines_grow_and_shrink() {
    let row = SIZE.y / 2;
    let Some(mut studio) = under_sky(SurfaceStyle::ImageBased) else { return };
    let mut widths = Vec::new();
    for style in [outlined(), SurfaceStyle::ImageBased] {
        studio.set_style(style);
        for _ in 0..6 {
            widths.push(studio.shoot().outline_in_row(row, 0..SIZE.x / 2));
            step(&mut studio);
        }
    }
    println!("{widths:?}");
    let (grown, shrunk) = widths.split_at(6);
    assert!(grown.is_sorted() && shrunk.iter().rev().is_sorted());
    assert_eq!((grown[0], grown[5], shrunk[5]), (0, 6, 0));
    assert!((2..=4).contains(&grown[3]) && (2..=4).contains(&shrunk[2]));
    studio.set_style(outlined());
    finish(&mut studio);
    // From one outline to another it stays.
    let SurfaceStyle::Toon(style) = outlined() else { unreachable!() };
    studio.set_style(SurfaceStyle::Toon(ToonStyle { bands: 2, ..style }));
    for _ in 0..4 {
        assert_eq!(studio.shoot().outline_in_row(row, 0..SIZE.x / 2), 6);
        step(&mut studio);
    }
}

#[test]
fn what_cannot_fade_changes_at_once() {
    let Some(mut studio) = under_sky(SurfaceStyle::ImageBased) else { return };
    for seconds in [0.0, -1.0, f32::NAN] {
        studio.app.world_mut().entity_mut(studio.ball).insert(StyleFade { seconds });
        studio.set_style(toon());
        studio.shoot();
        assert_eq!(meshes(&mut studio), 1, "{seconds} s");
        studio.set_style(SurfaceStyle::ImageBased);
        studio.shoot();
    }
    studio.set_ball(
        StandardMaterial { alpha_mode: AlphaMode::Blend, ..Color::WHITE.with_alpha(0.5).into() },
        SurfaceStyle::ImageBased,
    );
    studio.app.world_mut().entity_mut(studio.ball).insert(StyleFade { seconds: SECONDS });
    studio.shoot();
    studio.set_style(toon());
    studio.shoot();
    assert_eq!(meshes(&mut studio), 1, "transparent");
    studio.set_ball(Color::WHITE, SurfaceStyle::ImageBased);
    studio.app.world_mut().entity_mut(studio.ball).insert(StyleFade { seconds: SECONDS });
    studio.shoot();
    studio.set_style(toon());
    studio.shoot();
    assert_eq!(meshes(&mut studio), 2);
    studio.app.world_mut().entity_mut(studio.ball).insert(PhantomObject::default());
    studio.shoot();
    assert_eq!(meshes(&mut studio), 1, "a phantom has no style");
}
