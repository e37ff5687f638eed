//! Angles and unit vectors that are accurate on every driver: the shader library `trigonometry.wgsl`.
//!
//! On the CPU the standard library is as accurate. The twins below test the formulas of the shader.

use bevy::{prelude::*, shader::load_shader_library};

/// Loads the shader library for the shaders of a plugin.
pub(crate) fn load(app: &mut App) {
    load_shader_library!(app, "trigonometry.wgsl");
}

#[cfg(test)]
mod tests {
    use bevy::math::Vec2;
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

    /// Twin of `angle_of` in `trigonometry.wgsl`.
    fn angle_of(v: Vec2) -> f32 {
        let (low, high) = (v.abs().min_element(), v.abs().max_element());
        let is_upper = low > 0.414_213_56 * high;
        let (above, below, start) = if is_upper { (low - high, low + high, FRAC_PI_4) } else { (low, high, 0.0) };
        let x = above / below.max(1e-30);
        let z = x * x;
        let p = ((8.053_744_5e-2 * z - 1.387_768_6e-1) * z + 1.997_771_1e-1) * z - 3.333_295e-1;
        let octant = start + (p * z * x + x);
        let quadrant = if v.y.abs() > v.x.abs() { FRAC_PI_2 - octant } else { octant };
        let half_turn = if v.x < 0.0 { PI - quadrant } else { quadrant };
        if v.y < 0.0 { -half_turn } else { half_turn }
    }

    /// Twin of `unit_vector` in `trigonometry.wgsl`.
    fn unit_vector(angle: f32) -> Vec2 {
        let x = 0.25 * angle;
        let z = x * x;
        let doubled = |v: Vec2| Vec2::new(1.0 - 2.0 * v.y * v.y, 2.0 * v.x * v.y);
        doubled(doubled(Vec2::new(
            ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0,
            ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1) * z * x + x,
        )))
    }

    const STEPS: i32 = 100_000;

    #[test]
    fn angles_are_those_of_double_precision() {
        for i in -STEPS..=STEPS {
            let angle = f64::from(i) * std::f64::consts::PI / f64::from(STEPS);
            for length in [1e-6, 0.3, 1.0, 700.0] {
                let v = Vec2::new((length * angle.cos()) as f32, (length * angle.sin()) as f32);
                let truth = f64::from(v.y).atan2(f64::from(v.x));
                assert!((f64::from(angle_of(v)) - truth).abs() < 3e-7, "{v}: {} instead of {truth}", angle_of(v));
            }
        }
        assert_eq!(angle_of(Vec2::ZERO), 0.0);
    }

    #[test]
    fn sines_and_cosines_are_those_of_double_precision() {
        for i in -STEPS..=STEPS {
            let angle = (f64::from(i) * std::f64::consts::PI / f64::from(STEPS)) as f32;
            let (sin, cos) = f64::from(angle).sin_cos();
            let got = unit_vector(angle).as_dvec2();
            assert!((got.x - cos).abs() < 7e-7 && (got.y - sin).abs() < 7e-7, "{angle}: {got}");
        }
    }
}
