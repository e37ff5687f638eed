//! Bounding sphere of all casters.

use glam::Vec3;

/// Minimum fraction of the last sphere's radius that the casters must fill to keep that sphere.
const MIN_KEPT_FILL: f32 = 0.7;
/// Base of the radii: each radius is a power of it. So casters may grow a little before they leave their sphere, and
/// the texels of shadow maps keep their size.
const RADIUS_STEP: f32 = 1.125;

/// Sphere around casters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BoundingSphere {
    pub center: Vec3,
    pub radius: f32,
}

impl BoundingSphere {
    /// Returns a sphere around spheres, centered in their common box. `None` if it would be empty or not finite.
    pub(super) fn around(spheres: &[BoundingSphere]) -> Option<Self> {
        let low = spheres.iter().map(|s| s.center - s.radius).reduce(Vec3::min)?;
        let high = spheres.iter().map(|s| s.center + s.radius).reduce(Vec3::max)?;
        let center = 0.5 * (low + high);
        let radius = spheres.iter().map(|s| s.center.distance(center) + s.radius).fold(0.0, f32::max);
        (center.is_finite() && radius.is_finite() && radius > 0.0).then_some(Self { center, radius })
    }

    /// Returns the last sphere if it still contains this one without being much too large, or else this one with some
    /// margin.
    pub(super) fn or_keep(self, last: Option<Self>) -> Self {
        match last {
            Some(last)
                if last.center.distance(self.center) + self.radius <= last.radius
                    && self.radius >= MIN_KEPT_FILL * last.radius =>
            {
                last
            }
            _ => Self { radius: RADIUS_STEP.powf((self.radius.ln() / RADIUS_STEP.ln()).ceil()), ..self },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_is_kept_until_casters_leave_it_or_shrink() {
        let unit = |x: f32, radius: f32| BoundingSphere { center: Vec3::new(x, 0.0, 0.0), radius };
        assert_eq!(unit(0.05, 0.9).or_keep(Some(unit(0.0, 1.0))), unit(0.0, 1.0));
        for (left, last) in [(unit(0.2, 0.9), unit(0.0, 1.0)), (unit(0.0, 0.5), unit(0.0, 1.0))] {
            let fitted = left.or_keep(Some(last));
            assert_eq!(fitted.center, left.center);
            assert!((1.0..RADIUS_STEP + 1e-4).contains(&(fitted.radius / left.radius)), "{fitted:?}");
        }
        let both = BoundingSphere::around(&[unit(-1.0, 0.5), unit(1.0, 0.5)]).expect("not empty");
        assert_eq!(both, unit(0.0, 1.5));
        assert_eq!(BoundingSphere::around(&[]), None);
    }
}
