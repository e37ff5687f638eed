//! Ellipses: outlines of balls in a frame.

use bevy::prelude::*;

/// Ellipse in pixel coordinates.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct Ellipse {
    /// Center in pixels.
    pub center: Vec2,
    /// Half lengths of the longer and the shorter axis in pixels.
    pub semi_axes: Vec2,
    /// Angle of the longer axis against +u, in radians, positive towards +v (clockwise on the screen).
    pub angle: f32,
}

impl Ellipse {
    /// Half width and half height of the upright box around the ellipse, in pixels.
    pub fn half_extent(&self) -> Vec2 {
        let (sin, cos) = self.angle.sin_cos();
        let long = self.semi_axes.x * Vec2::new(cos, sin);
        let short = self.semi_axes.y * Vec2::new(-sin, cos);
        (long * long + short * short).map(f32::sqrt)
    }

    /// Whether a pixel position lies inside.
    pub fn contains(&self, pixel: Vec2) -> bool {
        let local = Vec2::from_angle(-self.angle).rotate(pixel - self.center);
        (local / self.semi_axes).length_squared() <= 1.0
    }
}
