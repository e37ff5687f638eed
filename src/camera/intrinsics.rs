//! The model of a calibrated camera: a pinhole and the distortion of its lens.

use super::Distortion;
use bevy::prelude::*;

/// Pinhole intrinsics of a camera, in pixels of the frames that it delivers.
///
/// Image coordinates have their origin at the top-left corner of the frame, +u right and +v down; the pixel in the
/// corner covers 0…1 and has its center at 0.5. (OpenCV and ROS count from the center of that pixel, so their principal
/// points are smaller by 0.5; [`Intrinsics::open`] adds it.)
///
/// Frames are undistorted when they arrive, see [`camera`](super#distortion). So [`project`](Self::project) and
/// [`ray`](Self::ray) are those of the pinhole, and their pixels those of the undistorted frame, which has the same
/// focal lengths and principal point. [`distort_pixel`](Self::distort_pixel) and
/// [`undistort_pixel`](Self::undistort_pixel) map between it and what the lens shows.
///
/// ```
/// # use bevy::math::{UVec2, Vec2};
/// # use bevy_mirrorball::camera::Intrinsics;
/// let webcam = Intrinsics::new(Vec2::splat(600.0), Vec2::new(320.0, 240.0), UVec2::new(640, 480));
/// assert_eq!(webcam.scaled_to(UVec2::new(1280, 960)).focal.x, 1200.0);
/// ```
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct Intrinsics {
    /// Focal lengths along u and v, in pixels. Finite and above 0.
    pub focal: Vec2,
    /// Principal point in pixels: the intersection of the optical axis with the frame. Usually close to half of
    /// [`size`](Self::size).
    pub center: Vec2,
    /// Width and height in pixels of the frames that these numbers belong to.
    pub size: UVec2,
    /// Distortion of the lens. Defaults to none.
    pub distortion: Distortion,
}

impl Intrinsics {
    /// Intrinsics without distortion from the focal lengths, the principal point and the size of the frames that they
    /// belong to, all in pixels.
    pub const fn new(focal: Vec2, center: Vec2, size: UVec2) -> Self {
        Self { focal, center, size, distortion: Distortion::NONE }
    }

    /// Intrinsics from the horizontal field of view in radians (0…π, exclusive), for square pixels and a centered
    /// principal point.
    pub fn from_horizontal_fov(size: UVec2, fov_radians: f32) -> Self {
        let focal = 0.5 * size.x as f32 / (0.5 * fov_radians).tan();
        Self::new(Vec2::splat(focal), size.as_vec2() * 0.5, size)
    }

    /// Intrinsics of the same camera for frames of another size (scaled, not cropped).
    pub fn scaled_to(&self, size: UVec2) -> Self {
        let scale = size.as_vec2() / self.size.as_vec2();
        Self { focal: self.focal * scale, center: self.center * scale, size, ..*self }
    }

    /// Intrinsics of the same camera for frames that are turned by a quarter, clockwise: what was the lower edge is the
    /// left one. Phones turn their frames like this when they are held upright, in one direction or, after three
    /// turns, in the other; with the principal point in the middle and no tangential distortion both are equal.
    ///
    /// ```
    /// # use bevy::math::{UVec2, Vec2};
    /// # use bevy_mirrorball::camera::Intrinsics;
    /// let across = Intrinsics::new(Vec2::new(600.0, 601.0), Vec2::new(322.0, 239.0), UVec2::new(640, 480));
    /// let upright = Intrinsics::new(Vec2::new(601.0, 600.0), Vec2::new(241.0, 322.0), UVec2::new(480, 640));
    /// assert_eq!(across.turned(), upright);
    /// ```
    pub fn turned(&self) -> Self {
        let Distortion { p1, p2, .. } = self.distortion;
        Self {
            focal: self.focal.yx(),
            center: Vec2::new(self.size.y as f32 - self.center.y, self.center.x),
            size: self.size.yx(),
            // (p2, p1) is a vector of the frame.
            distortion: Distortion { p1: p2, p2: -p1, ..self.distortion },
        }
    }

    /// Returns whether every number is finite, the focal lengths are above 0 and the size is not empty.
    pub fn is_valid(&self) -> bool {
        self.focal.is_finite()
            && self.center.is_finite()
            && self.distortion.coefficients().iter().all(|coefficient| coefficient.is_finite())
            && self.focal.min_element() > 0.0
            && self.size.min_element() > 0
    }

    /// Pixel at which the lens shows what is at a pixel of the undistorted frame.
    pub fn distort_pixel(&self, undistorted: Vec2) -> Vec2 {
        self.center + self.focal * self.distortion.distort((undistorted - self.center) / self.focal)
    }

    /// Pixel of the undistorted frame with what the lens shows at a pixel; it may be outside of the frame. `None` if
    /// the lens cannot show anything there, see [`Distortion::undistort`].
    pub fn undistort_pixel(&self, distorted: Vec2) -> Option<Vec2> {
        let point = self.distortion.undistort((distorted - self.center) / self.focal)?;
        Some(self.center + self.focal * point)
    }

    /// Pixel of the undistorted frame at which a point in camera space is (meters, Bevy axes: the camera looks along
    /// −Z).
    ///
    /// Returns `None` for points beside or behind the camera (z ≥ 0).
    pub fn project(&self, pos_camera: Vec3) -> Option<Vec2> {
        (pos_camera.z < 0.0).then(|| self.center + self.focal * Vec2::new(pos_camera.x, -pos_camera.y) / -pos_camera.z)
    }

    /// Unit direction in camera space (Bevy axes) of the ray through a pixel of the undistorted frame.
    pub fn ray(&self, pixel: Vec2) -> Vec3 {
        let p = (pixel - self.center) / self.focal;
        Vec3::new(p.x, -p.y, -1.0).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_projected_ray_returns_to_its_pixel() {
        let k = Intrinsics::new(Vec2::new(600.0, 610.0), Vec2::new(321.0, 239.0), UVec2::new(640, 480));
        for pixel in [Vec2::ZERO, Vec2::new(640.0, 480.0), Vec2::new(100.5, 400.25)] {
            let back = k.project(k.ray(pixel) * 3.0).expect("in front of the camera");
            assert!(back.distance(pixel) < 1e-3, "{pixel} came back as {back}");
        }
    }

    #[test]
    fn distorted_pixels_return_and_lie_inwards_for_a_barrel() {
        let distortion = Distortion { k1: -0.25, p2: 0.001, ..Distortion::NONE };
        let k = Intrinsics {
            distortion,
            ..Intrinsics::new(Vec2::new(600.0, 610.0), Vec2::new(321.0, 239.0), UVec2::new(640, 480))
        };
        assert_eq!(k.distort_pixel(k.center), k.center);
        for pixel in [Vec2::ZERO, Vec2::new(640.0, 480.0), Vec2::new(100.5, 400.25)] {
            let seen = k.distort_pixel(pixel);
            assert!(seen.distance(k.center) < pixel.distance(k.center) - 2.0, "{pixel} is seen at {seen}");
            let back = k.undistort_pixel(seen).expect("in view");
            assert!(back.distance(pixel) < 1e-2, "{pixel} came back as {back}");
        }
    }

    #[test]
    fn a_turned_camera_shows_the_same_points_on_the_turned_frame() {
        let distortion = Distortion { k1: -0.2, p1: 0.003, p2: -0.002, ..Distortion::NONE };
        let across = Intrinsics {
            distortion,
            ..Intrinsics::new(Vec2::new(600.0, 610.0), Vec2::new(325.0, 236.0), UVec2::new(640, 480))
        };
        let upright = across.turned();
        let turned = |pixel: Vec2| Vec2::new(across.size.y as f32 - pixel.y, pixel.x);
        for pixel in [Vec2::ZERO, Vec2::new(640.0, 480.0), Vec2::new(100.5, 400.25)] {
            let [expected, seen] = [turned(across.distort_pixel(pixel)), upright.distort_pixel(turned(pixel))];
            assert!(expected.distance(seen) < 1e-3, "{pixel}: {seen} instead of {expected}");
        }
        let back = upright.turned().turned().turned();
        assert!(back.center.distance(across.center) < 1e-4 && back.size == across.size, "{back:?}");
    }

    #[test]
    fn up_in_space_is_up_in_the_frame() {
        let k = Intrinsics::from_horizontal_fov(UVec2::new(640, 480), 1.0);
        let above = k.project(Vec3::new(0.0, 0.1, -1.0)).expect("in front of the camera");
        assert!(above.y < k.center.y);
        assert!(k.project(Vec3::new(0.0, 0.0, 1.0)).is_none());
    }
}
