//! Bands of light and shadow on toon surfaces.

use crate::studio::{COLOR_TOLERANCE, Picture, SIZE, Studio, ball_mesh, normals, toon};
use bevy::{camera::RenderTarget, prelude::*};
use bevy_mirrorball::{camera::FramePixels, prelude::*, probe::UniformSky};

/// Bands are not compared this near their edges (in bands), which are smoothed over a pixel. It is 3° on a ball.
const EDGE: f32 = 0.16;
/// Fraction of a ball's pixels that may be mixtures at band edges: most where light comes from the camera.
const MIXED: f32 = 0.2;

/// Largest brightness of the dark color, as a fraction of the brightest light, for two bands and more.
const MAX_DARK: [f32; 4] = [0.45, 0.2, 0.1, 0.0];

/// The color of white paper at a position between the darkest and the brightest light, as the documentation has it.
/// `None` near an edge.
pub(super) fn band_color(position: f32, bands: u32, opposite: Vec3, bright: Vec3) -> Option<Vec3> {
    let scaled = position * bands as f32;
    let is_near_edge = (1..bands).any(|edge| (scaled - edge as f32).abs() < EDGE);
    let band = scaled.floor().clamp(0.0, bands as f32 - 1.0);
    let dark = opposite * (MAX_DARK[bands as usize - 2] * luminance(bright) / luminance(opposite).max(1e-6)).min(1.0);
    let lowest = dark.lerp(bright, 0.5 / bands as f32);
    let lightness = [lowest, bright].map(|color| luminance(color).cbrt());
    let wanted = lightness[0] + (lightness[1] - lightness[0]) * band / (bands as f32 - 1.0);
    let level = (wanted.powi(3) - luminance(dark)) / (luminance(bright) - luminance(dark));
    (!is_near_edge).then_some(dark.lerp(bright, level))
}

pub(super) fn luminance(color: Vec3) -> f32 {
    color.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Asserts that the ball shows the bands of light whose position between `dark` and `bright` is known per normal.
pub(super) fn assert_bands(picture: &Picture, bands: u32, dark: Vec3, bright: Vec3, position: impl Fn(Vec3) -> f32) {
    let mut seen: Vec<(Vec3, u32)> = Vec::new();
    let mut worst = 0.0_f32;
    let mut total = 0;
    for (pixel, normal) in normals() {
        total += 1;
        let color = picture.linear(pixel);
        match seen.iter_mut().find(|(known, _)| known.abs_diff_eq(color, 0.013)) {
            Some((_, count)) => *count += 1,
            None => seen.push((color, 1)),
        }
        if let Some(expected) = band_color(position(normal), bands, dark, bright) {
            worst = worst.max((color - expected).abs().max_element());
        }
    }
    let flat: Vec<_> = seen.iter().filter(|(_, count)| *count as f32 > 0.02 * total as f32).collect();
    let mixed = total - flat.iter().map(|(_, count)| count).sum::<u32>();
    println!("{bands} bands: {flat:?}, {mixed} of {total} pixels mixed, off by {worst:.4}");
    assert_eq!(flat.len(), bands as usize);
    assert!(mixed as f32 <= MIXED * total as f32 && worst <= COLOR_TOLERANCE);
}

#[test]
fn one_lamp_shows_exactly_the_bands_asked_for() {
    const RADIANCE: f32 = 0.8;
    let Some(mut studio) = Studio::new(toon(3)) else { return };
    let unlit = studio.shoot();
    assert_eq!(unlit.linear(SIZE / 2), Vec3::ZERO, "without any light");
    let dir = Vec3::new(0.8, 0.5, 0.3).normalize();
    studio.add_lamp(dir, RADIANCE);
    for bands in [2, 3, 5] {
        studio.set_style(toon(bands));
        let picture = studio.shoot();
        assert_bands(&picture, bands, Vec3::ZERO, Vec3::splat(RADIANCE), |normal| normal.dot(dir).max(0.0));
    }
    let five = studio.shoot();
    studio.set_style(toon(99));
    assert_eq!(studio.shoot().difference(&five), 0, "99 bands are 5");
}

#[test]
fn a_glossy_ball_has_a_highlight_where_it_mirrors_the_lamp() {
    let style = |highlight| SurfaceStyle::Toon(ToonStyle { highlight, outline_width: 0.0, ..default() });
    let Some(mut studio) = Studio::new(style(false)) else { return };
    let gray = studio.add(ball_mesh(), Color::linear_rgb(0.2, 0.2, 0.2), style(false));
    studio.app.world_mut().despawn(std::mem::replace(&mut studio.ball, gray));
    let dir = Vec3::new(0.5, 0.4, 0.6).normalize();
    studio.add_lamp(dir, 0.8);
    let matte = studio.shoot();
    studio.set_style(style(true));
    let glossy = studio.shoot();
    let spot: Vec<Vec3> =
        normals().filter(|(pixel, _)| glossy.linear(*pixel).x > matte.linear(*pixel).x + 0.1).map(|(_, n)| n).collect();
    let center = spot.iter().sum::<Vec3>().normalize_or_zero();
    let expected = (dir + Vec3::Z).normalize();
    let radius = spot.iter().map(|n| n.angle_between(expected).to_degrees()).fold(0.0, f32::max);
    println!("{} pixels around {center}, expected {expected}, {radius:.1}° from there at most", spot.len());
    // Phong's lobe of 19.9 is half as high 15° from its middle, which normals reach by half that turn.
    assert!(center.distance(expected) < 0.03 && (6.5..9.0).contains(&radius));
}

#[test]
fn a_colored_environment_colors_the_bands() {
    let (dark, bright) = (Vec3::new(0.15, 0.15, 0.3), Vec3::new(0.7, 0.6, 0.3));
    for dir in [Vec3::new(-0.6, 0.7, 0.2).normalize(), Vec3::new(0.9, -0.3, 0.1).normalize()] {
        let Some(mut studio) = Studio::new(toon(3)) else { return };
        studio.add_sky(dir, dark, bright);
        for bands in [2, 3, 5] {
            studio.set_style(toon(bands));
            assert_bands(&studio.shoot(), bands, dark, bright, |normal| 0.5 + 0.5 * normal.dot(dir));
        }
    }
}

const SKY: f32 = 0.4;
/// Height of the wall, and focal length of the camera above it in pixels.
const WALL: f32 = 0.3;
const FOCAL: f32 = 80.0;

/// A desk in a toon style beside a long wall, from above, under an even sky. Returns the desk and the wall, too.
fn walled_desk() -> Option<(Studio, Entity, Entity)> {
    let mut studio = Studio::new(SurfaceStyle::Engine)?;
    let world = studio.app.world_mut();
    world.despawn(studio.ball);
    world.despawn(studio.camera);
    let intrinsics = Intrinsics::new(Vec2::splat(FOCAL), 0.5 * SIZE.as_vec2(), SIZE);
    let gray =
        FramePixels::new(SIZE, vec![128; 4 * (SIZE.x * SIZE.y) as usize]).expect("as many bytes as the size says");
    let above = Transform::from_xyz(0.0, 1.0, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z);
    let target = RenderTarget::Image(studio.picture.clone().into());
    world.spawn((ArCamera::new(intrinsics), CameraFeed::pixels(gray), above, target, Msaa::Off));
    let sky = UniformSky { radiance: Some(Vec3::splat(SKY)) };
    world.spawn((LightProbeSphere { radius: 0.1, ..default() }, sky, Transform::from_xyz(0.3, 0.05, 0.3)));
    world.spawn(ShadowDomeLight { surfels: 0, ..default() });
    let desk = studio.add(Plane3d::default().mesh().size(2.0, 2.0).build(), Color::WHITE, toon(3));
    let wall = Cuboid::new(0.02, WALL, 4.0).mesh().build();
    let wall = wall.translated_by(Vec3::new(-0.31, 0.5 * WALL, 0.0));
    let wall = studio.add(wall, Color::WHITE, SurfaceStyle::Engine);
    Some((studio, desk, wall))
}

/// Pixels at some distances from the wall, and the fraction of the sky there.
fn places() -> impl Iterator<Item = (UVec2, f32)> {
    [0.03, 0.06, 0.1, 0.15, 0.25, 0.4, 0.7].into_iter().map(|away| {
        // A long wall hides half of (1 − sin of the angle between its upper edge and the zenith) of a uniform sky.
        let fraction = 0.5 * (1.0 + f32::sin(f32::atan(away / WALL)));
        let column = (0.5 * SIZE.x as f32 + FOCAL * (away - 0.3)) as u32;
        (UVec2::new(column, SIZE.y / 2), fraction)
    })
}

#[test]
fn a_dome_shadow_drops_the_band() {
    let Some((mut studio, desk, wall)) = walled_desk() else { return };
    let shadowed = studio.shoot();
    // Under a light from above, what is lacking counts as lacking from 30 % of the light: the same bands.
    let key = ToonKey::Direction(Vec3::Y);
    let keyed = ToonStyle { key, highlight: false, outline_width: 0.0, ..default() };
    studio.app.world_mut().entity_mut(desk).insert(SurfaceStyle::Toon(keyed));
    let keyed = studio.shoot();
    studio.app.world_mut().despawn(wall);
    let open = studio.shoot();
    let mut seen = Vec::new();
    for (pixel, fraction) in places() {
        // Of an even sky, 70 % counts as dark.
        let sky = Vec3::splat(SKY);
        let expected = band_color((fraction - 0.7) / 0.3, 3, sky, sky).map(|color| color.x);
        let [with, by_key, without] = [&shadowed, &keyed, &open].map(|picture| picture.linear(pixel).x);
        println!("{fraction:.2} of the sky: {with:.3} and {by_key:.3}, expected {expected:.3?}, open {without:.3}");
        assert!((without - SKY).abs() < COLOR_TOLERANCE);
        if let Some(expected) = expected {
            assert!((with - expected).abs() < COLOR_TOLERANCE && (by_key - expected).abs() < COLOR_TOLERANCE);
            seen.push((with * 1000.0) as u32);
        }
    }
    seen.dedup();
    assert_eq!(seen.len(), 3, "three bands");
}

#[test]
fn a_soft_dome_shadow_is_a_gradient_between_the_bands() {
    let Some((mut studio, desk, _)) = walled_desk() else { return };
    let hard = studio.shoot();
    let soft = ToonStyle { softness: 1.0, highlight: false, outline_width: 0.0, ..default() };
    studio.app.world_mut().entity_mut(desk).insert(SurfaceStyle::Toon(soft));
    let soft = studio.shoot();
    let row = |picture: &Picture| {
        let mut values: Vec<u32> = (0..60)
            .map(|step| picture.linear(UVec2::new(SIZE.x / 2 - 22 + step, SIZE.y / 2)).x)
            .map(|value| (value * 200.0) as u32)
            .collect();
        assert!(values.windows(2).all(|pair| pair[0] <= pair[1] + 1), "brighter away from the wall: {values:?}");
        values.dedup();
        values.len()
    };
    let (hard, soft) = (row(&hard), row(&soft));
    println!("{hard} brightnesses with hard edges, {soft} with soft ones");
    assert!(hard <= 8 && soft >= 2 * hard);
}
