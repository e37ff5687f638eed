//! Bands that the eye tells apart.

use super::{bands::luminance, color_difference::ciede2000};
use crate::studio::{Studio, normals, toon};
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// Smallest difference between neighboring bands, less rounding to 8 bits.
const MIN_DIFFERENCE: f32 = 8.0 - 0.2;

/// Flat colors of a picture of the ball, by luminance.
fn flat_colors(studio: &mut Studio) -> Vec<Vec3> {
    let picture = studio.shoot();
    let mut seen: Vec<(Vec3, usize)> = Vec::new();
    for (pixel, _) in normals() {
        let color = picture.linear(pixel);
        match seen.iter_mut().find(|(known, _)| *known == color) {
            Some((_, count)) => *count += 1,
            None => seen.push((color, 1)),
        }
    }
    seen.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let mut flat: Vec<Vec3> = Vec::new();
    for (color, _) in seen.iter().filter(|(_, count)| *count > normals().count() / 100) {
        if !flat.iter().any(|known| known.abs_diff_eq(*color, 0.015)) {
            flat.push(*color);
        }
    }
    flat.sort_by(|a, b| luminance(*a).total_cmp(&luminance(*b)));
    flat
}

#[test]
fn neighboring_bands_differ_in_even_and_in_directed_light() {
    let Some(mut studio) = Studio::new(toon(3)) else { return };
    // From the side, so that the camera sees the darkest band too.
    let dir = Vec3::new(0.76, 0.64, 0.11).normalize();
    let rooms = [(Vec3::splat(0.6), Vec3::splat(0.95)), (Vec3::new(0.05, 0.06, 0.08), Vec3::new(1.0, 0.95, 0.9))];
    let paints =
        [Vec3::ONE, Vec3::splat(0.4), Vec3::new(0.8, 0.4, 0.1), Vec3::new(0.9, 0.8, 0.1), Vec3::new(0.2, 0.6, 0.5)];
    for (dark, bright) in rooms {
        studio.add_sky(dir, dark, bright);
        for paint in paints {
            studio.set_ball(Color::linear_rgb(paint.x, paint.y, paint.z), toon(3));
            for bands in [2, 3, 4, 5] {
                if luminance(bright * paint) < if bands > 3 { 0.35 } else { 0.18 } {
                    continue;
                }
                studio.set_style(toon(bands));
                let colors = flat_colors(&mut studio);
                let least = colors.windows(2).map(|pair| ciede2000(pair[0], pair[1])).fold(f32::INFINITY, f32::min);
                println!("{bands} bands of {paint} from {dark}: {least:.1}");
                assert!(colors.len() == bands as usize && least >= MIN_DIFFERENCE, "{colors:?}");
            }
        }
    }
}

#[test]
fn soft_edges_are_gradients_and_keep_the_middle_of_the_bands() {
    let Some(mut studio) = Studio::new(toon(3)) else { return };
    studio.add_lamp(Vec3::Z, 0.8);
    let hard = studio.shoot();
    let soft = |softness| SurfaceStyle::Toon(ToonStyle { softness, highlight: false, outline_width: 0.0, ..default() });
    for (softness, expected) in [(0.0, 0.0), (0.5, 0.5), (f32::NAN, 0.0)] {
        studio.set_style(soft(softness));
        let picture = studio.shoot();
        // Positions are N·L = N.z here; of those, this fraction lies in transitions.
        let (mut changed, mut wrong) = (0, 0);
        for (pixel, normal) in normals() {
            let from_edge = (3.0 * normal.z - (3.0 * normal.z).round()).abs();
            let is_edge = from_edge < 0.5 * expected && normal.z > 0.3 && normal.z < 0.75;
            let difference = (picture.linear(pixel) - hard.linear(pixel)).abs().max_element();
            changed += usize::from(difference > 0.01);
            wrong += usize::from(difference > 0.01 && !is_edge && from_edge > 0.5 * expected + 0.12);
        }
        println!("softness {softness}: {changed} pixels differ from hard edges, {wrong} of them not at edges");
        assert!(wrong == 0 && (changed > 300) == (expected > 0.0));
    }
}
