//! Spherical harmonics of environments up to order 2, nine coefficients per channel, for code on the CPU.
//!
//! They reproduce the irradiance of an environment without strong lamps to about 1 % (Ramamoorthi & Hanrahan 2001)
//! and are off by several percent under lamps. Rendering uses the filtered maps instead.

use super::{CubePixels, face_direction};
use crate::luminance::luminance;
use glam::{UVec2, Vec3};
use std::f32::consts::PI;

/// Radiance by direction as spherical harmonics up to order 2.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnvironmentHarmonics {
    /// Linear red, green and blue for each of the real, orthonormal spherical harmonics 1, y, z, x, xy, yz, 3z² − 1,
    /// xz, x² − y² in world axes.
    pub coefficients: [Vec3; 9],
}

/// Factor of the cosine lobe for each order: irradiance ÷ π relative to radiance.
const COSINE: [f32; 3] = [1.0, 2.0 / 3.0, 0.25];

impl EnvironmentHarmonics {
    /// Values of the real spherical harmonics up to order 2 in a unit direction.
    pub fn basis(dir: Vec3) -> [f32; 9] {
        let Vec3 { x, y, z } = dir;
        let constant = 0.5 / PI.sqrt();
        let (linear, product) = (3.0_f32.sqrt() * constant, 15.0_f32.sqrt() * constant);
        [
            constant,
            linear * y,
            linear * z,
            linear * x,
            product * x * y,
            product * y * z,
            0.5 * 5.0_f32.sqrt() * constant * (3.0 * z * z - 1.0),
            product * x * z,
            0.5 * product * (x * x - y * y),
        ]
    }

    /// Radiance from a unit world direction. It may be negative beside bright lamps.
    pub fn radiance(&self, dir_world: Vec3) -> Vec3 {
        self.sum(dir_world, [1.0; 3])
    }

    /// Irradiance ÷ π on a surface with this unit normal, the radiance of a white matte surface. Clamped to 0 and
    /// above.
    pub fn diffuse(&self, normal_world: Vec3) -> Vec3 {
        self.sum(normal_world, COSINE).max(Vec3::ZERO)
    }

    /// Unit direction from which most light comes, by luminance; `None` if light comes equally from all directions.
    pub fn dominant_direction(&self) -> Option<Vec3> {
        let of_coefficient = |i: usize| luminance(self.coefficients[i]);
        Vec3::new(of_coefficient(3), of_coefficient(1), of_coefficient(2)).try_normalize()
    }

    fn sum(&self, dir: Vec3, orders: [f32; 3]) -> Vec3 {
        let basis = Self::basis(dir);
        (0..9).map(|i| self.coefficients[i] * basis[i] * orders[usize::from(i > 0) + usize::from(i > 3)]).sum()
    }
}

impl CubePixels {
    /// Projects the cube onto spherical harmonics.
    pub fn harmonics(&self) -> EnvironmentHarmonics {
        let mut coefficients = [Vec3::ZERO; 9];
        let mut whole = 0.0;
        let edge = self.edge.max(1);
        for (i, texel) in (0u32..).zip(&self.texels) {
            let at = (UVec2::new(i % edge, i / edge % edge).as_vec2() + 0.5) * (2.0 / edge as f32) - 1.0;
            let angle = (1.0 + at.length_squared()).powf(-1.5);
            let basis = EnvironmentHarmonics::basis(face_direction(i / (edge * edge), at));
            for (coefficient, basis) in coefficients.iter_mut().zip(basis) {
                *coefficient += texel * (angle * basis);
            }
            whole += angle;
        }
        // The solid angle of a texel is its fraction of the sphere.
        let norm = if whole > 0.0 { 4.0 * PI / whole } else { 0.0 };
        EnvironmentHarmonics { coefficients: coefficients.map(|coefficient| coefficient * norm) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment_map::equirect_direction;
    use glam::Vec2;

    fn directions() -> impl Iterator<Item = Vec3> {
        (0..60).map(|i| equirect_direction(Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / 60.0)))
    }

    fn cube(radiance: impl Fn(Vec3) -> Vec3) -> CubePixels {
        let edge = 32;
        let texels = (0..6 * edge * edge).map(|i| {
            let at = (UVec2::new(i % edge, i / edge % edge).as_vec2() + 0.5) * (2.0 / edge as f32) - 1.0;
            radiance(face_direction(i / (edge * edge), at))
        });
        CubePixels { edge, texels: texels.collect() }
    }

    #[test]
    fn what_is_of_order_two_is_kept_and_its_irradiance_is_known() {
        // As irradiance ÷ π, 2 + d keeps ⅔ of its slope, and x² − y² a quarter of its value.
        let harmonics = cube(|d| 2.0 + d + Vec3::splat(d.x * d.x - d.y * d.y)).harmonics();
        for d in directions() {
            let radiance = 2.0 + d + Vec3::splat(d.x * d.x - d.y * d.y);
            let diffuse = 2.0 + d * (2.0 / 3.0) + Vec3::splat(0.25 * (d.x * d.x - d.y * d.y));
            assert!(harmonics.radiance(d).distance(radiance) < 5e-3, "{d}");
            assert!(harmonics.diffuse(d).distance(diffuse) < 5e-3, "{d}");
        }
    }

    #[test]
    fn most_light_comes_from_the_lamp() {
        let lamp = Vec3::new(0.3, 0.8, -0.5).normalize();
        let harmonics = cube(|d| Vec3::splat(if d.dot(lamp) > 0.95 { 30.0 } else { 0.1 })).harmonics();
        assert!(harmonics.dominant_direction().is_some_and(|dir| dir.dot(lamp) > 0.999));
        assert_eq!(cube(|_| Vec3::ZERO).harmonics().dominant_direction(), None);
    }
}
