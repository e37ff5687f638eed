//! Light detection: compact directions in the environment that are much brighter than the rest.

use super::{
    radiance_cells::RadianceCell,
    regions::{Region, connected_groups},
};
use crate::{luminance::luminance, median::median_by};
use bevy::reflect::Reflect;
use glam::Vec3;

/// A light, as detected in one frame.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct DetectedLight {
    /// Direction to the light from the center of the ball, unit vector in world space.
    pub direction: Vec3,
    /// Position in world space, meters; `None` if the light is distant or the desk does not reveal its position.
    pub position: Option<Vec3>,
    /// Irradiance at a surface that faces the light, per channel, linear camera units (radiance · steradian).
    pub irradiance: Vec3,
    /// Half of the angle that the light subtends, radians: that of a disk with the same variance.
    pub angular_radius: f32,
    /// Fraction of all light that arrives at the ball, 0…1.
    pub fraction: f32,
}

/// Smallest brightness of a light's cells relative to the median. Overcast skies vary by a factor of three.
const MIN_CONTRAST: f32 = 4.0;
/// Smallest brightness of a light's cells relative to the mean.
const MIN_OVER_MEAN: f32 = 2.5;
/// Largest root mean square radius of a group that is never split, radians. Wider groups are split if that leaves
/// little variance.
const MAX_UNSPLIT_RMS_RADIUS: f32 = 0.12;
/// Largest root mean square radius of a light, radians. A wider group that cannot be split is a glow, in which only the
/// brightest cells count.
const MAX_LIGHT_RMS_RADIUS: f32 = 0.35;
/// Largest variance of the parts of a group, relative to that of the group, at which they are separate lights.
const MAX_SPLIT_VARIANCE: f32 = 0.45;
/// Smallest brightness of a light relative to its surroundings. Excludes wide bright skies.
const MIN_OVER_SURROUNDINGS: f32 = 2.5;
/// Width of the surroundings beyond a light's rim, radians.
const SURROUNDINGS_WIDTH: f32 = 0.35;
/// Smallest brightness, relative to the brightest cell, of the cells that determine a light's direction.
const MIN_CORE_BRIGHTNESS: f32 = 0.25;
/// Largest distance at which two groups are merged, radians.
const MAX_MERGE_DISTANCE: f32 = 0.12;
/// Smallest fraction of all light that a light has to have.
pub(in crate::lighting) const MIN_LIGHT_FRACTION: f32 = 0.01;
/// Largest number of lights.
const MAX_LIGHTS: usize = 12;
/// Smallest angular radius that cells of a few degrees can resolve, radians.
const MIN_ANGULAR_RADIUS: f32 = 0.01;

/// Detection rounds. Each looks for fainter lights in the remaining cells, which have a lower mean.
const ROUNDS: usize = 4;

/// Detects the lights of a sky whose clipped parts have been recovered, strongest first.
///
/// Cells well above the median and the mean are grouped, groups are split where that leaves little of their variance
/// (as median cut does with its boxes), and neighboring groups are merged. This repeats without the detected lights,
/// for fainter ones.
pub(super) fn detect_lights(sky: &[RadianceCell], gains: &[Vec3]) -> Vec<DetectedLight> {
    let radiance: Vec<Vec3> = sky.iter().zip(gains).map(|(cell, gain)| cell.radiance(*gain)).collect();
    let brightness: Vec<f32> = radiance.iter().map(|r| luminance(*r)).collect();
    let energy = |i: usize| brightness[i] * sky[i].solid_angle;
    let total: f32 = (0..sky.len()).map(energy).sum();
    let Some(median) = median_by(&mut brightness.clone(), f32::total_cmp).filter(|_| total > 0.0) else {
        return Vec::new();
    };
    let mut rest: Vec<usize> = (0..sky.len()).collect();
    let mut lights = Vec::new();
    for _ in 0..ROUNDS {
        let (sum, solid_angle) = rest.iter().fold((0.0, 0.0), |(e, s), &i| (e + energy(i), s + sky[i].solid_angle));
        let threshold = (MIN_CONTRAST * median).max(MIN_OVER_MEAN * sum / f32::max(solid_angle, 1e-6));
        let bright: Vec<usize> = rest.iter().copied().filter(|&i| brightness[i] > threshold).collect();
        if bright.is_empty() {
            break;
        }
        let excess = |i: usize| (brightness[i] - 0.5 * threshold) * sky[i].solid_angle;
        let mut parts = split_groups(connected_groups(&bright, sky), sky, &brightness, &excess);
        merge_close(&mut parts, sky, &excess);
        for part in parts {
            let radius = part.rms_radius * std::f32::consts::SQRT_2;
            let irradiance: Vec3 = part.cells.iter().map(|&i| radiance[i] * sky[i].solid_angle).sum();
            let light = DetectedLight {
                direction: core_direction(&part, sky, &brightness),
                position: None,
                irradiance,
                angular_radius: radius.max(MIN_ANGULAR_RADIUS),
                fraction: luminance(irradiance) / total,
            };
            if light.fraction >= MIN_LIGHT_FRACTION
                && light.direction != Vec3::ZERO
                && is_compact(&part, sky, &brightness)
            {
                lights.push(light);
            }
            // The halo of a light is no light either.
            let mut is_rest = vec![true; sky.len()];
            for &i in &part.cells {
                is_rest[i] = false;
            }
            let nearest = (radius + MAX_MERGE_DISTANCE).cos();
            rest.retain(|&i| is_rest[i] && sky[i].dir_world.dot(part.dir_world) < nearest);
        }
    }
    lights.sort_by(|a, b| b.fraction.total_cmp(&a.fraction));
    lights.truncate(MAX_LIGHTS);
    lights
}

fn split_groups(
    groups: Vec<Vec<usize>>,
    sky: &[RadianceCell],
    brightness: &[f32],
    weight: &impl Fn(usize) -> f32,
) -> Vec<Region> {
    let mut groups: Vec<Region> = groups.into_iter().map(|cells| Region::new(cells, sky, weight)).collect();
    let sum = |region: &Region| region.cells.iter().map(|&i| weight(i)).sum::<f32>();
    let mut parts = Vec::new();
    while let Some(group) = groups.pop() {
        if group.rms_radius <= MAX_UNSPLIT_RMS_RADIUS || group.cells.len() < 2 {
            parts.push(group);
            continue;
        }
        let [a, b] = group.clone().split(sky, weight);
        let left =
            (sum(&a) * a.rms_radius.powi(2) + sum(&b) * b.rms_radius.powi(2)) / sum(&group).max(f32::MIN_POSITIVE);
        if !a.cells.is_empty() && !b.cells.is_empty() && left <= MAX_SPLIT_VARIANCE * group.rms_radius.powi(2) {
            groups.extend([a, b]);
            continue;
        }
        let core = if group.rms_radius > MAX_LIGHT_RMS_RADIUS { core(&group, brightness) } else { Vec::new() };
        if core.is_empty() || core.len() == group.cells.len() {
            parts.push(group);
        } else {
            groups.extend(connected_groups(&core, sky).into_iter().map(|cells| Region::new(cells, sky, weight)));
        }
    }
    parts
}

/// Cells about as bright as the brightest cell of a group.
fn core(part: &Region, brightness: &[f32]) -> Vec<usize> {
    let peak = part.cells.iter().map(|&i| brightness[i]).fold(0.0, f32::max);
    part.cells.iter().copied().filter(|&i| brightness[i] > MIN_CORE_BRIGHTNESS * peak).collect()
}

/// Center of the cells that are about as bright as the brightest cell of the group. A glow around the sun does not move
/// it.
fn core_direction(part: &Region, sky: &[RadianceCell], brightness: &[f32]) -> Vec3 {
    let peak = part.cells.iter().map(|&i| brightness[i]).fold(0.0, f32::max);
    let weight = |i: usize| (brightness[i] - MIN_CORE_BRIGHTNESS * peak).max(0.0) * sky[i].solid_angle;
    part.cells.iter().map(|&i| weight(i) * sky[i].dir_world).sum::<Vec3>().normalize_or(part.dir_world)
}

/// Whether a group is much brighter than a ring around it.
fn is_compact(part: &Region, sky: &[RadianceCell], brightness: &[f32]) -> bool {
    let mean = |cells: &mut dyn Iterator<Item = usize>| {
        let (sum, total) = cells
            .fold((0.0, 0.0), |(sum, total), i| (sum + brightness[i] * sky[i].solid_angle, total + sky[i].solid_angle));
        sum / f32::max(total, 1e-6)
    };
    let own = mean(&mut part.cells.iter().copied());
    let radius = std::f32::consts::SQRT_2 * part.rms_radius;
    let max_distance = (radius + SURROUNDINGS_WIDTH).cos();
    let mut is_own = vec![false; sky.len()];
    for &i in &part.cells {
        is_own[i] = true;
    }
    // Neighboring lights must not hide a light: only darker cells count as surroundings.
    let is_around =
        |i: &usize| brightness[*i] < own && !is_own[*i] && sky[*i].dir_world.dot(part.dir_world) > max_distance;
    let mut around = (0..sky.len()).filter(is_around);
    own >= MIN_OVER_SURROUNDINGS * mean(&mut around)
}

fn merge_close(parts: &mut Vec<Region>, sky: &[RadianceCell], weight: &impl Fn(usize) -> f32) {
    loop {
        let close = (0..parts.len())
            .flat_map(|i| (i + 1..parts.len()).map(move |j| (i, j)))
            .find(|&(i, j)| parts[i].dir_world.distance(parts[j].dir_world) < MAX_MERGE_DISTANCE);
        let Some((i, j)) = close else {
            return;
        };
        let other = parts.swap_remove(j);
        let mut cells = std::mem::take(&mut parts[i].cells);
        cells.extend(other.cells);
        parts[i] = Region::new(cells, sky, weight);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{environment_map::cube_directions, lighting::solver::radiance_cells::CELLS_PER_EDGE};

    fn sky(radiance: impl Fn(Vec3) -> Vec3) -> Vec<RadianceCell> {
        cube_directions(CELLS_PER_EDGE)
            .map(|(dir_world, solid_angle)| RadianceCell {
                dir_world,
                solid_angle,
                seen: radiance(dir_world),
                ..Default::default()
            })
            .collect()
    }

    fn lights(radiance: impl Fn(Vec3) -> Vec3) -> Vec<DetectedLight> {
        let sky = sky(radiance);
        detect_lights(&sky, &vec![Vec3::ONE; sky.len()])
    }

    #[test]
    fn no_light_is_invented_under_uniform_and_overcast_skies_and_bright_walls() {
        assert!(lights(|_| Vec3::splat(0.7)).is_empty());
        // CIE overcast sky over a gray ground.
        let overcast = |dir: Vec3| Vec3::splat(if dir.y > 0.0 { (1.0 + 2.0 * dir.y) / 3.0 } else { 0.1 });
        assert!(lights(overcast).is_empty());
        assert!(lights(|dir| Vec3::splat(if dir.x > 0.0 { 1.0 } else { 0.3 })).is_empty());
        assert!(lights(|_| Vec3::ZERO).is_empty());
    }

    #[test]
    fn two_suns_are_found_with_color_and_size() {
        let suns = [Vec3::new(0.3, 0.8, 0.5).normalize(), Vec3::new(-0.7, 0.4, -0.1).normalize()];
        let found = lights(|dir| {
            if dir.angle_between(suns[0]) < 0.1 {
                Vec3::new(60.0, 50.0, 40.0)
            } else if dir.angle_between(suns[1]) < 0.06 {
                Vec3::new(20.0, 30.0, 60.0)
            } else {
                Vec3::splat(0.2)
            }
        });
        assert_eq!(found.len(), 2, "{found:?}");
        for (light, sun) in found.iter().zip(suns) {
            assert!(light.direction.angle_between(sun).to_degrees() < 1.5, "{light:?}");
        }
        assert!(
            (found[0].angular_radius - 0.1).abs() < 0.025 && (found[1].angular_radius - 0.06).abs() < 0.025,
            "{found:?}"
        );
        assert!(found[0].irradiance.x > found[0].irradiance.z && found[1].irradiance.x < found[1].irradiance.z);
        let expected = 60.0 * std::f32::consts::PI * 0.01;
        assert!((found[0].irradiance.x / expected - 1.0).abs() < 0.15, "{found:?}");
    }

    #[test]
    fn two_lamps_that_touch_are_two_lights() {
        let lamps = [Vec3::new(0.0, 0.5, -1.0), Vec3::new(0.45, 0.5, -1.0)].map(Vec3::normalize);
        let found =
            lights(|dir| Vec3::splat(if lamps.iter().any(|l| dir.angle_between(*l) < 0.2) { 9.0 } else { 0.1 }));
        assert_eq!(found.len(), 2, "{found:?}");
    }

    /// City lights at night: one wide bright band, with most of its light from a few lamps in it.
    #[test]
    fn lamps_in_a_wide_glow_are_lights_of_their_own_and_parts_of_the_glow_are_faint() {
        let lamps = [(0.4_f32, 60.0), (-0.9, 45.0)];
        let towards = |azimuth: f32| Vec3::new(azimuth.sin(), 0.12, -azimuth.cos()).normalize();
        let glow = |dir: Vec3| if (0.0..0.3).contains(&dir.y) && dir.z < 0.3 { 1.5 } else { 0.05 };
        let found = lights(|dir| {
            let lamp = lamps.iter().find(|(azimuth, _)| dir.angle_between(towards(*azimuth)) < 0.06);
            Vec3::splat(lamp.map_or(glow(dir), |(_, radiance)| *radiance))
        });
        assert!(found.len() > 1, "{found:?}");
        for (light, (azimuth, _)) in found.iter().zip(lamps) {
            assert!(light.direction.angle_between(towards(azimuth)).to_degrees() < 1.5, "{found:?}");
            assert!(light.angular_radius < 0.15, "{found:?}");
        }
        assert!(found[2..].iter().all(|part| part.fraction < 0.5 * found[1].fraction), "{found:?}");
    }
}
