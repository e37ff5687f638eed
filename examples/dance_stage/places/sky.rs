//! Skies of places: equirectangular images of linear radiance.

use bevy::prelude::*;
use bevy_mirrorball::environment_map::{EquirectPixels, equirect_direction};

/// Width of a sky that is painted here, in pixels.
const WIDTH: u32 = 256;
/// Radiance of the campus's sky at the zenith and at the horizon, and of the paving, in frame buffer units.
const ZENITH: Vec3 = Vec3::new(0.22, 0.46, 0.86);
const HORIZON: Vec3 = Vec3::new(0.60, 0.80, 0.98);
const PAVING: Vec3 = Vec3::new(0.36, 0.35, 0.33);
/// Sine of the angle below the horizon down to which there is haze.
const HAZE: f32 = 0.15;

/// A clear sky over bright ground.
pub(super) fn gradient() -> EquirectPixels {
    let size = UVec2::new(WIDTH, WIDTH / 2);
    let radiance = |i: u32| {
        let dir = equirect_direction((UVec2::new(i % size.x, i / size.x).as_vec2() + 0.5) / size.as_vec2());
        let air = HORIZON.lerp(ZENITH, dir.y.max(0.0).sqrt());
        // Haze hides where the paving ends.
        PAVING.lerp(air, ((dir.y + HAZE) / HAZE).clamp(0.0, 1.0))
    };
    EquirectPixels { size, texels: (0..size.element_product()).map(radiance).collect() }
}

/// The same sky without what is brighter than a limit: its sun, which shines as a lamp.
pub(super) fn without_sun(sky: &EquirectPixels, max_radiance: f32) -> EquirectPixels {
    let dimmed = |texel: &Vec3| *texel * (max_radiance / texel.max_element().max(max_radiance));
    EquirectPixels { size: sky.size, texels: sky.texels.iter().map(dimmed).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_brighter_than_the_limit_stays_and_the_sun_keeps_its_color() {
        let texels = vec![Vec3::new(0.5, 0.25, 1.0), Vec3::new(40.0, 20.0, 10.0)];
        let dim = without_sun(&EquirectPixels { size: UVec2::new(2, 1), texels }, 2.0);
        assert_eq!(dim.texels, [Vec3::new(0.5, 0.25, 1.0), Vec3::new(2.0, 1.0, 0.5)]);
    }

    #[test]
    fn the_painted_sky_is_bluest_above_and_dimmer_below() {
        let sky = gradient();
        let (up, side, down) = (sky.sample(Vec3::Y), sky.sample(Vec3::new(1.0, 0.05, 0.0)), sky.sample(Vec3::NEG_Y));
        assert!(up.z / up.x > side.z / side.x, "{up} {side}");
        assert!(down.z < up.z && down.min_element() > 0.1, "{down}");
    }
}
