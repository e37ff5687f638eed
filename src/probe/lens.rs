//! Lenses of probe cameras: the mapping between pixels and directions. WGSL twin: `unwrap/lens.wgsl`.

use super::{fisheye_projection::FisheyeProjection, lens_error::LensError};
use bevy::prelude::*;
use std::f32::consts::{PI, TAU};

/// Mapping between the pixels of a frame and the directions around its camera, which looks along −Z with +Y up.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ProbeLens {
    /// A fisheye lens, whose image is a circle within the frame.
    Fisheye {
        /// Projection of the lens.
        projection: FisheyeProjection,
        /// Angle across the whole circle, in degrees: above 0 and at most
        /// [`widest_degrees`](FisheyeProjection::widest_degrees) of the projection.
        fov_degrees: f32,
        /// Circle in the frame. `None` is a circle in the middle that touches the nearer borders.
        circle: Option<ImageCircle>,
    },
    /// The whole frame of a 360° camera, twice as wide as high. Columns are the azimuth from −Z towards +X; rows
    /// run from +Y down.
    Equirect,
    /// A photograph of a mirrored ball that was taken from afar, or cropped by somebody else. The direction r is
    /// shown at the half vector of r and `wrap` times the direction to the camera.
    SphereMap {
        /// Factor on the direction to the camera: 1.0 for a ball that shows all directions. Finite and above 0.
        wrap: f32,
        /// Outline of the ball. `None` is a circle in the middle that touches the nearer borders.
        circle: Option<ImageCircle>,
    },
}

impl Default for ProbeLens {
    fn default() -> Self {
        Self::Fisheye { projection: FisheyeProjection::default(), fov_degrees: 180.0, circle: None }
    }
}

/// Circle in a frame.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct ImageCircle {
    /// Center in pixels, from the top-left corner.
    pub center: Vec2,
    /// Radius in pixels, finite and above 0.
    pub radius: f32,
}

impl ImageCircle {
    fn within(size: UVec2) -> Self {
        Self { center: 0.5 * size.as_vec2(), radius: 0.5 * size.min_element() as f32 }
    }
}

impl ProbeLens {
    /// Validates the settings of the lens.
    ///
    /// # Errors
    /// Returns a [`LensError`] that names the wrong field and its valid range.
    pub fn check(&self) -> Result<(), LensError> {
        let circle = match *self {
            Self::Fisheye { projection, fov_degrees, circle } => {
                let widest = projection.widest_degrees();
                if !(fov_degrees > 0.0 && fov_degrees <= widest) {
                    return Err(LensError::FieldOfView { found: fov_degrees, widest });
                }
                circle
            }
            Self::Equirect => None,
            Self::SphereMap { wrap, circle } => {
                if !(wrap > 0.0 && wrap.is_finite()) {
                    return Err(LensError::Wrap(wrap));
                }
                circle
            }
        };
        match circle {
            Some(ImageCircle { center, radius }) if !(radius > 0.0 && radius.is_finite() && center.is_finite()) => {
                Err(LensError::Circle { center, radius })
            }
            _ => Ok(()),
        }
    }

    fn circle(&self, size: UVec2) -> ImageCircle {
        match *self {
            Self::Fisheye { circle, .. } | Self::SphereMap { circle, .. } => {
                circle.unwrap_or_else(|| ImageCircle::within(size))
            }
            Self::Equirect => ImageCircle { center: Vec2::ZERO, radius: 1.0 },
        }
    }

    /// Pixel position at which a frame of a size shows a direction (unit vector, camera space); `None` if the
    /// direction is out of view.
    pub fn pixel(&self, dir_camera: Vec3, size: UVec2) -> Option<Vec2> {
        let ImageCircle { center, radius } = self.circle(size);
        match *self {
            Self::Fisheye { projection, fov_degrees, .. } => {
                let half_fov = 0.5 * fov_degrees.to_radians();
                let across = dir_camera.xy().length();
                let angle = across.atan2(-dir_camera.z);
                let side = Vec2::new(dir_camera.x, -dir_camera.y) / across.max(1e-6);
                let from_middle = projection.radius(angle) / projection.radius(half_fov);
                (angle <= half_fov).then(|| center + radius * from_middle * side)
            }
            Self::Equirect => {
                let azimuth = (dir_camera.x.atan2(-dir_camera.z) / TAU).rem_euclid(1.0);
                Some(size.as_vec2() * Vec2::new(azimuth, dir_camera.y.clamp(-1.0, 1.0).acos() / PI))
            }
            Self::SphereMap { wrap, .. } => {
                let half = (dir_camera + Vec3::new(0.0, 0.0, wrap)).normalize_or_zero();
                (dir_camera.z + wrap > 0.0).then(|| center + radius * Vec2::new(half.x, -half.y))
            }
        }
    }

    /// Direction (unit vector, camera space) that a pixel position shows; `None` outside the circle of the lens.
    pub fn direction(&self, pixel: Vec2, size: UVec2) -> Option<Vec3> {
        let ImageCircle { center, radius } = self.circle(size);
        let p = (pixel - center) / radius;
        let side = Vec2::new(p.x, -p.y);
        match *self {
            Self::Fisheye { projection, fov_degrees, .. } => {
                let angle = projection.angle(p.length() * projection.radius(0.5 * fov_degrees.to_radians()));
                let (sin, cos) = angle.sin_cos();
                (p.length() <= 1.0).then(|| (side.normalize_or_zero() * sin).extend(-cos))
            }
            Self::Equirect => {
                let uv = pixel / size.as_vec2();
                let ((sin_azimuth, cos_azimuth), (sin, cos)) = ((TAU * uv.x).sin_cos(), (PI * uv.y).sin_cos());
                Some(Vec3::new(sin * sin_azimuth, cos, -sin * cos_azimuth))
            }
            Self::SphereMap { wrap, .. } => {
                // The farther solution of |t·h − wrap·e| = 1 with the half vector h.
                let half = (p.length() <= 1.0).then(|| side.extend((1.0 - side.length_squared()).max(0.0).sqrt()))?;
                let discriminant = 1.0 - wrap * wrap * (1.0 - half.z * half.z);
                (discriminant >= 0.0)
                    .then(|| (half * (wrap * half.z + discriminant.sqrt()) - Vec3::new(0.0, 0.0, wrap)).normalize())
            }
        }
    }

    /// Returns the parameters of the lens for frames of a size.
    pub(crate) fn numbers(&self, size: UVec2) -> LensNumbers {
        let ImageCircle { center, radius } = self.circle(size);
        let mut numbers =
            LensNumbers { focal: Vec2::splat(radius), center, projection: Vec4::X, half_fov: PI, wrap: 1.0 };
        match *self {
            Self::Fisheye { projection, fov_degrees, .. } => {
                numbers.half_fov = 0.5 * fov_degrees.to_radians();
                numbers.projection = projection.one_hot() / projection.radius(numbers.half_fov);
            }
            Self::Equirect => numbers.focal = size.as_vec2(),
            Self::SphereMap { wrap, .. } => numbers.wrap = wrap,
        }
        numbers
    }
}

/// Parameters of a lens in a frame, as the unwrap shader reads them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LensNumbers {
    /// Radius of the circle in pixels, twice; size of an equirectangular frame; focal lengths of a pinhole camera.
    pub focal: Vec2,
    /// Center of the circle in pixels; 0 for an equirectangular frame; principal point of a pinhole camera.
    pub center: Vec2,
    /// 1 ÷ the distance of the rim from the center in focal lengths, in the component of the lens's projection:
    /// equidistant, equisolid, stereographic, orthographic.
    pub projection: Vec4,
    /// Half the field of view, in radians.
    pub half_fov: f32,
    /// Factor on the direction to the camera in the half vector of a sphere map.
    pub wrap: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: UVec2 = UVec2::new(320, 240);

    fn fisheye(projection: FisheyeProjection, fov_degrees: f32) -> ProbeLens {
        ProbeLens::Fisheye { projection, fov_degrees, circle: None }
    }

    #[test]
    fn every_direction_in_view_comes_back_from_its_pixel() {
        use FisheyeProjection::{Equidistant, Equisolid, Orthographic, Stereographic};
        let off_center = Some(ImageCircle { center: Vec2::new(170.0, 111.0), radius: 93.0 });
        let lenses = [
            fisheye(Equidistant, 180.0),
            fisheye(Equidistant, 220.0),
            fisheye(Equisolid, 190.0),
            fisheye(Stereographic, 200.0),
            fisheye(Orthographic, 175.0),
            ProbeLens::Fisheye { projection: Equisolid, fov_degrees: 150.0, circle: off_center },
            ProbeLens::Equirect,
            ProbeLens::SphereMap { wrap: 1.0, circle: off_center },
            ProbeLens::SphereMap { wrap: 0.8, circle: None },
        ];
        for lens in lenses {
            lens.check().expect("can be");
            let mut found = 0;
            for (dir, _) in crate::environment_map::cube_directions(16) {
                let Some(pixel) = lens.pixel(dir, SIZE) else { continue };
                // At the rim of a ball and of an orthographic lens, a hundredth of a pixel spans a whole degree.
                let Some(back) = lens.direction(pixel, SIZE) else { continue };
                assert!(back.distance(dir) < 5e-3, "{lens:?}: {dir} came back as {back}");
                found += 1;
            }
            assert!(found > 500, "{lens:?}: {found}");
        }
    }

    #[test]
    fn a_lens_looks_along_minus_z_and_the_picture_is_upright() {
        let lens = fisheye(FisheyeProjection::Equidistant, 180.0);
        let near = |dir: Vec3, x: f32, y: f32| {
            let pixel = lens.pixel(dir, SIZE).expect("in view");
            assert!(pixel.distance(Vec2::new(x, y)) < 1e-3, "{dir}: {pixel}");
        };
        near(Vec3::NEG_Z, 160.0, 120.0);
        near(Vec3::new(1.0, 0.0, -1.0).normalize(), 220.0, 120.0);
        near(Vec3::new(0.0, 0.9999, -1e-2).normalize(), 160.0, 0.764);
        assert_eq!(lens.pixel(Vec3::Z, SIZE), None);
        let ball = ProbeLens::SphereMap { wrap: 1.0, circle: None };
        assert!(ball.pixel(Vec3::Z, SIZE).expect("the camera itself").distance(Vec2::new(160.0, 120.0)) < 1e-3);
        // Light from the right is halfway to the rim in the angle of the normal, at 45°.
        assert!(
            ball.pixel(Vec3::X, SIZE).expect("seen").distance(Vec2::new(160.0 + 120.0 * 0.5f32.sqrt(), 120.0)) < 1e-2
        );
    }

    #[test]
    fn what_no_lens_can_do_is_named() {
        let error = fisheye(FisheyeProjection::Orthographic, 200.0).check().expect_err("too wide");
        assert!(error.to_string().contains("fov_degrees") && error.to_string().contains("180"), "{error}");
        assert!(fisheye(FisheyeProjection::Equidistant, f32::NAN).check().is_err());
        assert_eq!(ProbeLens::SphereMap { wrap: 0.0, circle: None }.check(), Err(LensError::Wrap(0.0)));
        let circle = Some(ImageCircle { center: Vec2::ZERO, radius: -1.0 });
        assert!(
            ProbeLens::SphereMap { wrap: 1.0, circle }.check().expect_err("no radius").to_string().contains("radius")
        );
    }
}
