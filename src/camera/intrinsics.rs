//! The pinhole model of a calibrated camera.

use bevy::prelude::*;

/// Pinhole intrinsics of a camera, in pixels of the frames that it delivers.
///
/// Image coordinates have their origin at the top-left corner of the frame, +u right and +v down; the pixel in the
/// corner covers 0…1 and has its center at 0.5.
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

/// Distortion of a lens: the model of Brown and Conrady with its coefficients in the order of OpenCV.
///
/// It maps a point of the pinhole camera at `x, y` (in front of the camera, at a depth of 1; x right, y down) to
/// `x′ = x · r + 2 · p1 · x · y + p2 · (ρ² + 2 · x²)` and `y′ = y · r + p1 · (ρ² + 2 · y²) + 2 · p2 · x · y`, with
/// `ρ² = x² + y²` and `r = 1 + k1 · ρ² + k2 · ρ⁴ + k3 · ρ⁶`. All coefficients have no unit.
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

impl Distortion {
    /// A lens without distortion.
    pub const NONE: Self = Self { k1: 0.0, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 };
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

    /// Returns whether every number is finite, the focal lengths are above 0 and the size is not empty.
    pub fn is_valid(&self) -> bool {
        self.focal.is_finite()
            && self.center.is_finite()
            && self.focal.min_element() > 0.0
            && self.size.min_element() > 0
    }

    /// Pixel position of a point in camera space (meters, Bevy axes: the camera looks along −Z).
    ///
    /// Returns `None` for points beside or behind the camera (z ≥ 0).
    pub fn project(&self, pos_camera: Vec3) -> Option<Vec2> {
        (pos_camera.z < 0.0).then(|| self.center + self.focal * Vec2::new(pos_camera.x, -pos_camera.y) / -pos_camera.z)
    }

    /// Unit direction in camera space (Bevy axes) of the ray through a pixel position.
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
    fn up_in_space_is_up_in_the_frame() {
        let k = Intrinsics::from_horizontal_fov(UVec2::new(640, 480), 1.0);
        let above = k.project(Vec3::new(0.0, 0.1, -1.0)).expect("in front of the camera");
        assert!(above.y < k.center.y);
        assert!(k.project(Vec3::new(0.0, 0.0, 1.0)).is_none());
    }
}
