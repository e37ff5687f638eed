//! Distortion of lenses.

use bevy::{
    math::{DMat2, DVec2},
    prelude::*,
};

/// Distortion of a lens: the model of Brown (1966) and Conrady (1919) with its coefficients in the order of OpenCV.
///
/// It maps a point of the pinhole camera at `x, y` (in front of the camera, at a depth of 1; x right, y down) to
/// `x′ = x · r + 2 · p1 · x · y + p2 · (ρ² + 2 · x²)` and `y′ = y · r + p1 · (ρ² + 2 · y²) + 2 · p2 · x · y`, with
/// `ρ² = x² + y²` and `r = 1 + k1 · ρ² + k2 · ρ⁴ + k3 · ρ⁶`. All coefficients have no unit.
///
/// ```
/// # use bevy::math::Vec2;
/// # use bevy_mirrorball::camera::Distortion;
/// let barrel = Distortion { k1: -0.25, ..Distortion::NONE };
/// let seen = barrel.distort(Vec2::new(0.4, 0.3));
/// assert!((seen - Vec2::new(0.375, 0.28125)).length() < 1e-6);
/// assert!((barrel.undistort(seen).expect("in view") - Vec2::new(0.4, 0.3)).length() < 1e-6);
/// ```
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct Distortion {
    /// Radial, of the second power of the radius. Below 0 for barrels, as most lenses have.
    pub k1: f32,
    /// Radial, of the fourth power.
    pub k2: f32,
    /// Tangential: the lens is tilted vertically.
    pub p1: f32,
    /// Tangential: the lens is tilted horizontally.
    pub p2: f32,
    /// Radial, of the sixth power.
    pub k3: f32,
}

/// Largest number of Newton steps of [`Distortion::undistort`]. Lenses need 3 to 6.
const MAX_STEPS: u32 = 30;
/// Distance between a point and its image at which the steps end; a thousandth of a pixel at most.
const TOLERANCE: f64 = 1e-7;

impl Distortion {
    /// A lens without distortion.
    pub const NONE: Self = Self { k1: 0.0, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 };

    /// The coefficients in the order of OpenCV: k1, k2, p1, p2, k3.
    pub fn coefficients(&self) -> [f32; 5] {
        [self.k1, self.k2, self.p1, self.p2, self.k3]
    }

    /// Distortion from coefficients in the order of OpenCV: k1, k2, p1, p2, k3.
    pub fn from_coefficients([k1, k2, p1, p2, k3]: [f32; 5]) -> Self {
        Self { k1, k2, p1, p2, k3 }
    }

    /// Where the lens shows a point of the pinhole camera (at a depth of 1; x right, y down; no unit).
    ///
    /// Far outside of the view the polynomial turns back, and points there are of no use.
    pub fn distort(&self, point: Vec2) -> Vec2 {
        BrownConrady::from(*self).distort(point.as_dvec2()).as_vec2()
    }

    /// The point of the pinhole camera that the lens shows at `distorted`: the inverse of [`distort`](Self::distort).
    /// `None` if there is none, as for places that only a wider lens would show.
    pub fn undistort(&self, distorted: Vec2) -> Option<Vec2> {
        BrownConrady::from(*self).undistort(distorted.as_dvec2()).map(|point| point.as_vec2())
    }
}

/// The model in double precision, with the derivatives that calibration needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct BrownConrady {
    /// k1, k2, p1, p2, k3.
    pub coefficients: [f64; 5],
}

impl From<Distortion> for BrownConrady {
    fn from(distortion: Distortion) -> Self {
        Self { coefficients: distortion.coefficients().map(f64::from) }
    }
}

impl BrownConrady {
    pub(super) fn distort(&self, DVec2 { x, y }: DVec2) -> DVec2 {
        let [k1, k2, p1, p2, k3] = self.coefficients;
        let (xx, yy, xy) = (x * x, y * y, x * y);
        let square = xx + yy;
        let radial = 1.0 + square * (k1 + square * (k2 + square * k3));
        DVec2::new(
            x * radial + 2.0 * p1 * xy + p2 * (square + 2.0 * xx),
            y * radial + p1 * (square + 2.0 * yy) + 2.0 * p2 * xy,
        )
    }

    /// Derivative of the distorted point by the point.
    pub(super) fn by_point(&self, DVec2 { x, y }: DVec2) -> DMat2 {
        let [k1, k2, p1, p2, k3] = self.coefficients;
        let square = x * x + y * y;
        let radial = 1.0 + square * (k1 + square * (k2 + square * k3));
        // of the radial factor by the square of the radius, twice
        let slope = 2.0 * (k1 + square * (2.0 * k2 + 3.0 * square * k3));
        let across = slope * x * y + 2.0 * (p1 * x + p2 * y);
        DMat2::from_cols(
            DVec2::new(radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x, across),
            DVec2::new(across, radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x),
        )
    }

    /// Derivatives of the distorted point by the coefficients.
    pub(super) fn by_coefficients(DVec2 { x, y }: DVec2) -> [DVec2; 5] {
        let square = x * x + y * y;
        let point = DVec2::new(x, y);
        [
            point * square,
            point * square * square,
            DVec2::new(2.0 * x * y, square + 2.0 * y * y),
            DVec2::new(square + 2.0 * x * x, 2.0 * x * y),
            point * square * square * square,
        ]
    }

    /// Newton's method from the distorted point, with steps that are halved until they bring it nearer.
    pub(super) fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        let mut point = distorted;
        let mut miss = distorted - self.distort(point);
        for _ in 0..MAX_STEPS {
            if miss.length() < TOLERANCE {
                // Where the polynomial has turned back, it mirrors.
                return (self.by_point(point).determinant() > 0.0).then_some(point);
            }
            let slope = self.by_point(point);
            let step = if slope.determinant() > 1e-6 { slope.inverse() * miss } else { miss };
            let mut fraction = 1.0;
            loop {
                let next = point + step * fraction;
                let next_miss = distorted - self.distort(next);
                if next_miss.length() < miss.length() {
                    (point, miss) = (next, next_miss);
                    break;
                }
                fraction *= 0.5;
                if fraction < 1e-3 {
                    return None;
                }
            }
        }
        None
    }

    /// Radius of the pinhole camera, at a depth of 1, from which on the radial polynomial decreases: no lens shows
    /// anything there. Infinite for those that never do.
    pub(super) fn max_radius(&self) -> f64 {
        let [k1, k2, _, _, k3] = self.coefficients;
        // The derivative of ρ · r by ρ.
        let slope = |square: f64| 1.0 + square * (3.0 * k1 + square * (5.0 * k2 + 7.0 * square * k3));
        // In steps that no root pair of real lenses hides between; a radius of 4 is a field of view of 152°.
        let squares = (1..=1600).map(|i| 0.01 * f64::from(i));
        squares.into_iter().find(|square| slope(*square) <= 0.0).map_or(f64::INFINITY, |square| (square - 0.01).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Distortion = Distortion { k1: -0.3, k2: 0.12, p1: 0.002, p2: -0.003, k3: -0.02 };

    fn grid() -> impl Iterator<Item = Vec2> {
        (-6..=6).flat_map(|y| (-8..=8).map(move |x| 0.1 * Vec2::new(x as f32, y as f32)))
    }

    #[test]
    fn undistorted_points_return() {
        for point in grid() {
            let back = LENS.undistort(LENS.distort(point)).expect("in view");
            assert!(back.distance(point) < 2e-6, "{point} came back as {back}");
        }
        assert_eq!(Distortion::NONE.undistort(Vec2::new(3.0, -2.0)), Some(Vec2::new(3.0, -2.0)));
    }

    #[test]
    fn a_barrel_shows_nothing_beyond_its_border() {
        // ρ · (1 − 0.25 · ρ²) is at most 0.77, at ρ = 1.155.
        let barrel = Distortion { k1: -0.25, ..Distortion::NONE };
        assert!((BrownConrady::from(barrel).max_radius() - 1.155).abs() < 0.01);
        assert!(barrel.undistort(Vec2::new(0.75, 0.0)).expect("just in view").x < 1.155);
        assert_eq!(barrel.undistort(Vec2::new(0.0, 0.8)), None);
        assert_eq!(barrel.undistort(Vec2::NAN), None);
    }

    #[test]
    fn derivatives_are_those_of_the_model() {
        let lens = BrownConrady::from(LENS);
        for point in grid().map(|point| point.as_dvec2()) {
            let slope = lens.by_point(point);
            for (axis, column) in [(DVec2::X, slope.x_axis), (DVec2::Y, slope.y_axis)] {
                let change = (lens.distort(point + 1e-5 * axis) - lens.distort(point - 1e-5 * axis)) / 2e-5;
                assert!((change - column).length() < 1e-8, "{change} and {column}");
            }
            for (i, derivative) in BrownConrady::by_coefficients(point).into_iter().enumerate() {
                let mut more = lens;
                more.coefficients[i] += 1.0;
                assert!((more.distort(point) - lens.distort(point) - derivative).length() < 1e-9);
            }
        }
    }
}
