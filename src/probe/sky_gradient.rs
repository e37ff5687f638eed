//! Sky of three colors, fitted to a camera's frame.

use bevy::prelude::*;

/// Sky of three colors.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct SkyGradient {
    /// Direction to the zenith (unit vector, world space).
    pub up: Vec3,
    /// Radiance from the zenith, in linear camera units.
    pub zenith: Vec3,
    /// Radiance from the horizon, in linear camera units.
    pub horizon: Vec3,
    /// Radiance from below the horizon, in linear camera units.
    pub ground: Vec3,
}

/// Reflectance assumed below the horizon if no paper measures how much light falls there.
const ASSUMED_REFLECTANCE: f32 = 0.4;
/// Radiance from all directions before the first frame, in linear camera units.
const UNKNOWN_RADIANCE: f32 = 0.4;
/// Sine of the elevation up to which pixels count as horizon, and of the depression from which the ground has its own
/// color.
const MAX_HORIZON_SINE: f32 = 0.2;
/// Lower bound of the zenith's radiance, as a fraction of the mean sky.
const MIN_ZENITH_FRACTION: f32 = 0.2;
/// Relative change above which a newly fitted sky replaces the old one.
const MIN_REFIT_CHANGE: f32 = 0.05;

impl SkyGradient {
    pub(super) const UNKNOWN: Self = Self {
        up: Vec3::Y,
        zenith: Vec3::splat(UNKNOWN_RADIANCE),
        horizon: Vec3::splat(UNKNOWN_RADIANCE),
        ground: Vec3::splat(UNKNOWN_RADIANCE * ASSUMED_REFLECTANCE),
    };

    /// Returns the sky that explains parts of a frame, given as world directions (unit vectors) with their radiance,
    /// and the irradiance ÷ π on a horizontal surface, if known; `None` without any parts.
    pub fn fit(parts: impl Iterator<Item = (Vec3, Vec3)>, up: Vec3, irradiance_over_pi: Option<Vec3>) -> Option<Self> {
        let (mut all, mut horizon, mut ground, mut sky) = (Vec4::ZERO, Vec4::ZERO, Vec4::ZERO, Vec4::ZERO);
        for (dir, radiance) in parts {
            let (height, part) = (dir.dot(up), radiance.extend(1.0));
            all += part;
            if height.abs() < MAX_HORIZON_SINE {
                horizon += part;
            }
            if height < 0.0 {
                ground += part;
            } else {
                sky += part;
            }
        }
        let mean = |sum: Vec4| (sum.w > 0.0).then(|| sum.truncate() / sum.w);
        let ground = mean(ground).or(mean(all))?;
        let light = irradiance_over_pi.unwrap_or_else(|| mean(sky).unwrap_or(ground / ASSUMED_REFLECTANCE));
        // The irradiance of a horizontal surface under a sky that is linear in the sine of the elevation is
        // π (horizon / 3 + 2 zenith / 3).
        let horizon = mean(horizon).or(mean(sky)).unwrap_or(light);
        let zenith = (1.5 * light - 0.5 * horizon).max(MIN_ZENITH_FRACTION * light);
        Some(Self { up, zenith, horizon: (3.0 * light - 2.0 * zenith).max(Vec3::ZERO), ground })
    }

    /// Radiance from a direction (unit vector, world space).
    pub fn radiance(&self, dir: Vec3) -> Vec3 {
        let height = dir.dot(self.up);
        if height >= 0.0 {
            return self.horizon.lerp(self.zenith, height);
        }
        self.horizon.lerp(self.ground, (-height / MAX_HORIZON_SINE).min(1.0))
    }

    pub(super) fn is_like(&self, other: &Self) -> bool {
        let near = |a: Vec3, b: Vec3| (a - b).abs().max_element() <= MIN_REFIT_CHANGE * a.max(b).max_element();
        near(self.zenith, other.zenith)
            && near(self.horizon, other.horizon)
            && near(self.ground, other.ground)
            && self.up.dot(other.up) > 0.999
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment_map::cube_directions;

    #[test]
    fn a_fitted_sky_lights_paper_as_it_was_seen_to_be_lit() {
        let light = Vec3::new(0.9, 0.8, 0.7);
        let down = |i: i32| Vec3::new(0.1 * i as f32, -1.0, 0.3).normalize();
        let desk = (0..5).map(|i| (down(i), Vec3::splat(0.2)));
        let side = (0..5).map(|i| (Vec3::new(1.0, 0.02 * i as f32, 0.0).normalize(), Vec3::new(0.3, 0.5, 0.4)));
        let bright = (0..5).map(|i| (Vec3::new(1.0, 0.1 * i as f32, 0.0).normalize(), Vec3::splat(5.0)));
        for sky in [
            SkyGradient::fit(desk.clone(), Vec3::Y, Some(light)),
            SkyGradient::fit(desk.clone().chain(side), Vec3::Y, Some(light)),
            SkyGradient::fit(desk.clone().chain(bright), Vec3::Y, Some(light)),
        ] {
            let sky = sky.expect("parts were seen");
            let irradiance: Vec3 =
                cube_directions(32).map(|(dir, s)| sky.radiance(dir) * (dir.y.max(0.0) * s)).sum::<Vec3>();
            let found = irradiance / std::f32::consts::PI;
            assert!((found - light).abs().max_element() < 0.02, "{sky:?}: {found}");
            assert!(sky.zenith.min_element() > 0.0 && sky.ground == Vec3::splat(0.2));
        }
        assert!(SkyGradient::fit(std::iter::empty(), Vec3::Y, None).is_none());
    }
}
