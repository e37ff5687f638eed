//! Differences of colors as the eye sees them (CIEDE2000; Sharma, Wu and Dalal 2005, *The CIEDE2000 Color-Difference
//! Formula*).

use bevy::math::{Vec2, Vec3};
use std::f32::consts::TAU;

/// Lightness and chromatic coordinates of a linear color under daylight.
fn lab(linear: Vec3) -> Vec3 {
    let x = linear.dot(Vec3::new(0.4124, 0.3576, 0.1805)) / 0.95047;
    let y = linear.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    let z = linear.dot(Vec3::new(0.0193, 0.1192, 0.9505)) / 1.08883;
    let root = |t: f32| if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 };
    Vec3::new(116.0 * root(y) - 16.0, 500.0 * (root(x) - root(y)), 200.0 * (root(y) - root(z)))
}

/// Weight of saturated colors: C⁷ ÷ (C⁷ + 25⁷), rooted.
fn saturation(chroma: f32) -> f32 {
    (chroma.powi(7) / (chroma.powi(7) + 25_f32.powi(7))).sqrt()
}

/// Difference of two linear colors.
pub(super) fn ciede2000(a: Vec3, b: Vec3) -> f32 {
    difference(lab(a), lab(b))
}

fn difference(a: Vec3, b: Vec3) -> f32 {
    let chroma = |lab: Vec3| Vec2::new(lab.y, lab.z).length();
    let stretch = 1.0 + 0.5 * (1.0 - saturation(0.5 * (chroma(a) + chroma(b))));
    let [a, b] = [a, b].map(|lab| Vec3::new(lab.x, lab.y * stretch, lab.z));
    let hue = |lab: Vec3| lab.z.atan2(lab.y).rem_euclid(TAU);
    let is_gray = chroma(a) * chroma(b) < 1e-6;
    let turn = if is_gray { 0.0 } else { (hue(b) - hue(a) + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU };
    let mean_hue = if is_gray { hue(a) + hue(b) } else { hue(a) + 0.5 * turn };
    let (mean_lightness, mean_chroma) = (0.5 * (a.x + b.x), 0.5 * (chroma(a) + chroma(b)));
    let wave = |times: f32, degrees: f32| (times * mean_hue + degrees.to_radians()).cos();
    let t = 1.0 - 0.17 * wave(1.0, -30.0) + 0.24 * wave(2.0, 0.0) + 0.32 * wave(3.0, 6.0) - 0.2 * wave(4.0, -63.0);
    let from_middle = (mean_lightness - 50.0).powi(2);
    let lightness = (b.x - a.x) / (1.0 + 0.015 * from_middle / (20.0 + from_middle).sqrt());
    let chromatic = (chroma(b) - chroma(a)) / (1.0 + 0.045 * mean_chroma);
    let of_hue = 2.0 * (chroma(a) * chroma(b)).sqrt() * (0.5 * turn).sin() / (1.0 + 0.015 * mean_chroma * t);
    let near_blue = (mean_hue.to_degrees().rem_euclid(360.0) - 275.0) / 25.0;
    let rotation = -2.0 * saturation(mean_chroma) * (60.0 * (-near_blue * near_blue).exp()).to_radians().sin();
    (lightness.powi(2) + chromatic.powi(2) + of_hue.powi(2) + rotation * chromatic * of_hue).max(0.0).sqrt()
}

#[test]
fn differences_are_those_of_the_published_pairs() {
    // Sharma et al., table 1: pairs 1, 4, 7, 17, 19 and 25.
    let pairs = [
        ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
        ([50.0, -1.3802, -84.2814], [50.0, 0.0, -82.7485], 1.0),
        ([50.0, 0.0, 0.0], [50.0, -1.0, 2.0], 2.3669),
        ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
        ([50.0, 2.5, 0.0], [56.0, -27.0, -3.0], 31.9030),
        ([60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644),
    ];
    for (a, b, expected) in pairs {
        let found = difference(Vec3::from_array(a), Vec3::from_array(b));
        assert!((found - expected).abs() < 1e-3, "{found}, expected {expected}");
    }
}
