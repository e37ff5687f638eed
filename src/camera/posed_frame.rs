//! A frame together with the pinhole camera and the pose that it was taken with.

use super::{FramePixels, Intrinsics};
use bevy::transform::components::GlobalTransform;
use glam::{Affine3A, Vec2, Vec3};

/// A camera frame with everything that turns its pixels into rays and radiance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PosedFrame<'a> {
    /// The decoded frame.
    pub frame: &'a FramePixels,
    /// Intrinsics for frames of this size.
    pub intrinsics: Intrinsics,
    /// World → camera (Bevy axes), rigid.
    pub camera_from_world: Affine3A,
    /// Exposure relative to the camera's normal frames, which have 1.
    pub exposure: f32,
}

/// Pose of a camera: camera (Bevy axes) → world, rigid. A real camera has no scale, so that of its parents in the
/// scene is left out.
pub(crate) fn world_from_camera(place: &GlobalTransform) -> Affine3A {
    Affine3A::from(place.to_isometry())
}

impl PosedFrame<'_> {
    /// Pixel position of a point in world space (meters); `None` for points beside or behind the camera.
    pub(crate) fn project(&self, pos_world: Vec3) -> Option<Vec2> {
        self.intrinsics.project(self.camera_from_world.transform_point3(pos_world))
    }

    /// The four pixels around a pixel position with their weights in bilinear interpolation, which add up to 1. Values
    /// are linear, in units of this frame: its exposure is not divided out. The frame's border continues outwards.
    pub(crate) fn bilinear(&self, pixel: Vec2) -> [(f32, Vec3); 4] {
        let corner = (pixel - 0.5).floor();
        let t = pixel - 0.5 - corner;
        let (x, y) = (corner.x as i32, corner.y as i32);
        [
            ((1.0 - t.x) * (1.0 - t.y), self.frame.linear(x, y)),
            (t.x * (1.0 - t.y), self.frame.linear(x + 1, y)),
            ((1.0 - t.x) * t.y, self.frame.linear(x, y + 1)),
            (t.x * t.y, self.frame.linear(x + 1, y + 1)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::UVec2;

    #[test]
    fn bilinear_weights_add_up_and_prefer_the_nearest_pixel() {
        let frame = FramePixels::new(UVec2::new(2, 1), vec![0, 0, 0, 255, 255, 255, 255, 255]).expect("fits");
        let intrinsics = Intrinsics::from_horizontal_fov(frame.size, 1.0);
        let posed = PosedFrame { frame: &frame, intrinsics, camera_from_world: Affine3A::IDENTITY, exposure: 1.0 };
        let value =
            |x: f32| posed.bilinear(Vec2::new(x, 0.5)).iter().map(|(weight, value)| weight * value.x).sum::<f32>();
        assert_eq!([value(0.5), value(0.75), value(1.5), value(-3.0)], [0.0, 0.25, 1.0, 0.0]);
    }
}
