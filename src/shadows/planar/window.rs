//! The part of a receiver that a texture of shadows covers.

use super::super::bounding_sphere::BoundingSphere;
use bevy::prelude::*;

/// Steps across a receiver in which a window grows and moves, so that texels stay where they are while casters move a
/// little.
const STEPS: f32 = 32.0;

/// A rectangle of the receiver, in meters along its x and z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    pub(super) center: Vec2,
    pub(super) half_size: Vec2,
}

impl Window {
    /// Returns the smallest window around the shadows of spheres that lies on the receiver. `projections` are from the
    /// receiver's frame onto it. `None` if no shadow falls onto the receiver.
    pub(super) fn around(
        spheres: impl Iterator<Item = BoundingSphere> + Clone,
        projections: &[Mat4],
        margin: f32,
        receiver: Vec2,
    ) -> Option<Self> {
        let (mut low, mut high) = (Vec2::MAX, Vec2::MIN);
        for (sphere, projection) in projections.iter().flat_map(|p| spheres.clone().map(move |sphere| (sphere, p))) {
            for corner in 0..8 {
                let side = Vec3::new((corner & 1) as f32, (corner >> 1 & 1) as f32, (corner >> 2) as f32) * 2.0 - 1.0;
                let place = sphere.center + side * sphere.radius;
                // What is below the receiver has no shadow on it.
                let place = Vec3 { y: place.y.max(0.0), ..place };
                let shadow = *projection * place.extend(1.0);
                if shadow.w <= 1e-3 * projection.w_axis.w {
                    // As high as the light: its shadow reaches to infinity.
                    return Some(Self { center: Vec2::ZERO, half_size: receiver });
                }
                let place = Vec2::new(shadow.x, shadow.z) / shadow.w;
                (low, high) = (low.min(place), high.max(place));
            }
        }
        let step = 2.0 * receiver / STEPS;
        let low = ((low - margin) / step).floor().max(Vec2::splat(-0.5 * STEPS)) * step;
        let high = ((high + margin) / step).ceil().min(Vec2::splat(0.5 * STEPS)) * step;
        (low.cmplt(high).all()).then(|| Self { center: 0.5 * (low + high), half_size: 0.5 * (high - low) })
    }

    /// Clip space from the receiver's frame, with the first row of a texture at the lowest z.
    pub(super) fn clip_from_local(&self) -> Mat4 {
        let scale = 1.0 / self.half_size;
        Mat4::from_cols(
            Vec4::new(scale.x, 0.0, 0.0, 0.0),
            Vec4::ZERO,
            Vec4::new(0.0, -scale.y, 0.0, 0.0),
            Vec4::new(-self.center.x * scale.x, self.center.y * scale.y, 0.0, 1.0),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::{super::projection::planar_projection, *};

    fn shadow_of(center: Vec3, radius: f32, light: Vec4) -> Option<Window> {
        let spheres = [BoundingSphere { center, radius }];
        Window::around(spheres.into_iter(), &[planar_projection(Vec4::Y, light)], 0.0, Vec2::new(0.8, 0.6))
    }

    #[test]
    fn a_window_is_as_large_as_the_shadow_and_not_larger_than_the_receiver() {
        let below = shadow_of(Vec3::new(0.1, 0.2, 0.0), 0.1, Vec4::Y).expect("on the receiver");
        let (low, high) = (below.center - below.half_size, below.center + below.half_size);
        assert!(low.cmple(Vec2::new(0.0, -0.1)).all() && high.cmpge(Vec2::new(0.2, 0.1)).all(), "{below:?}");
        assert!(below.half_size.max_element() < 0.15, "{below:?}");
        let long = shadow_of(Vec3::new(0.1, 0.2, 0.0), 0.1, Vec4::new(1.0, 0.1, 0.0, 0.0)).expect("on the receiver");
        assert!(long.center.x - long.half_size.x <= -0.8 + 1e-6 && long.half_size.x < 0.8, "{long:?}");
        assert_eq!(shadow_of(Vec3::new(3.0, 0.2, 0.0), 0.1, Vec4::Y), None);
        let whole = shadow_of(Vec3::new(0.0, 0.9, 0.0), 0.1, Vec4::new(0.0, 1.0, 0.0, 1.0)).expect("up to the lamp");
        assert_eq!(whole, Window { center: Vec2::ZERO, half_size: Vec2::new(0.8, 0.6) });
    }

    #[test]
    fn corners_of_the_window_are_those_of_clip_space() {
        let window = Window { center: Vec2::new(0.3, -0.1), half_size: Vec2::new(0.2, 0.4) };
        let at = |x: f32, z: f32| window.clip_from_local().project_point3(Vec3::new(x, 0.0, z)).xy();
        assert!(at(0.1, -0.5).abs_diff_eq(Vec2::new(-1.0, 1.0), 1e-6));
        assert!(at(0.5, 0.3).abs_diff_eq(Vec2::new(1.0, -1.0), 1e-6));
    }
}
