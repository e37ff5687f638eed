//! Photographs of mirrored balls, unwrapped on the CPU: for tools, and in tests as the reference of the shaders of
//! `unwrap`.

use super::{
    ball_view::{BallView, EDGE_MARGIN_PIXELS},
    photo_pixels::PhotoPixels,
};
use crate::{
    camera::Intrinsics,
    environment_map::{EquirectPixels, equirect_direction},
};
use bevy::prelude::*;
use std::f32::consts::PI;

/// The constants from here on are those of the shaders of `unwrap`, which give the reasons.
const SHARP_BALL: f32 = 2.0;
const SMOOTH: f32 = 1.0;
const LEAK: f32 = 0.4;
const MAX_LEAK: f32 = 0.25;
const COARSE: [f32; 2] = [0.5, 1.0];
const RIM: [f32; 2] = [0.6, 0.15];
const RING: u32 = 12;
const MAX_SAMPLES: f32 = 4.0;
/// Smallest diameter of an outline, in pixels.
const MIN_DIAMETER: f32 = 4.0;
/// Largest diameter of an outline, as a multiple of the longer side of the photograph. Outlines are measured to a few
/// percent.
const MAX_DIAMETER: f32 = 1.05;
/// Lower bound of the half angle of the hidden cone, in degrees. A smaller cone is as good as none.
const MIN_HIDDEN_DEGREES: f32 = 0.5;

/// Photograph with a mirrored ball in it: a frame of a camera, or linear values that do not clip.
///
/// ```no_run
/// use bevy::prelude::*;
/// use bevy_mirrorball::probe::{BallPhoto, open_photo};
///
/// let photo = open_photo("ball.jpg").expect("a photograph");
/// // The ball was photographed from nearby and shows 280° of its surroundings.
/// let ball = BallPhoto::from_outline(&*photo, Vec2::new(1031.0, 1037.0), 1988.0, 280.0).expect("a ball");
/// ball.to_equirect(1024, Quat::IDENTITY).save("surroundings.hdr").expect("a writable folder");
/// ```
#[derive(Clone, Copy, Debug)]
pub struct BallPhoto<'a> {
    /// Pixels of the photograph: [`FramePixels`](crate::camera::FramePixels) or
    /// [`LinearPixels`](super::LinearPixels).
    pub frame: &'a dyn PhotoPixels,
    /// Intrinsics of the camera that took it.
    pub intrinsics: Intrinsics,
    /// Position and size of the ball.
    pub ball: BallView,
    /// Fraction of the light that the ball mirrors, above 0 and at most 1.
    pub reflectance: f32,
}

/// Error of [`BallPhoto::from_outline`]: the numbers describe no ball in the photograph.
#[derive(thiserror::Error, Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum BallPhotoError {
    /// The field of view, in degrees, is impossible.
    #[error(
        "a field of view of {0}° cannot be: give the camera's horizontal one (1 to 179), or how much of its surroundings the ball shows (181 to 360)"
    )]
    FieldOfView(f32),
    /// The outline is not in the photograph, too small, or larger than the photograph.
    #[error(
        "a ball of {diameter} pixels at {center} is not in a picture of {} × {} pixels; give center and diameter of its outline",
        .size.x, .size.y
    )]
    Outline {
        /// Center of the outline, in pixels.
        center: Vec2,
        /// Diameter of the outline, in pixels.
        diameter: f32,
        /// Size of the photograph, in pixels.
        size: UVec2,
    },
}

impl<'a> BallPhoto<'a> {
    /// Creates the photograph of a ball from its outline in the frame, with center and diameter in pixels. The ball
    /// gets reflectance 1 and radius 1.
    ///
    /// `fov_degrees` is either the camera's horizontal field of view (1 to below 180), with the optical axis in the
    /// middle of the frame; or the angle of the surroundings that the ball shows from rim to rim (above 180; 360 for
    /// a ball far away), with the optical axis through the ball, for photographs that were cropped.
    ///
    /// # Errors
    /// Returns a [`BallPhotoError`] that names the impossible number.
    pub fn from_outline(
        frame: &'a dyn PhotoPixels,
        center: Vec2,
        diameter: f32,
        fov_degrees: f32,
    ) -> Result<Self, BallPhotoError> {
        let size = frame.size();
        let is_inside = center.cmpge(Vec2::ZERO).all() && center.cmple(size.as_vec2()).all();
        // A ball may be cut off at the edges, but not on both sides of both axes.
        let largest = MAX_DIAMETER * size.max_element() as f32;
        if !(is_inside && (MIN_DIAMETER..=largest).contains(&diameter)) {
            return Err(BallPhotoError::Outline { center, diameter, size });
        }
        let radius = 0.5 * diameter;
        let (intrinsics, half_angle) = match fov_degrees {
            fov if (1.0..180.0).contains(&fov) => {
                let intrinsics = Intrinsics::from_horizontal_fov(size, fov.to_radians());
                let outward = (center - intrinsics.center).normalize_or(Vec2::X);
                // Perpendicular to the line from the middle of the frame, where perspective does not stretch the
                // outline.
                let [middle, rim] = [center, center + radius * outward.perp()].map(|pixel| intrinsics.ray(pixel));
                (intrinsics, middle.angle_between(rim))
            }
            fov if fov > 180.0 && fov <= 360.0 => {
                let hidden = (0.5 * (360.0 - fov)).max(MIN_HIDDEN_DEGREES).to_radians();
                (Intrinsics::new(Vec2::splat(radius / hidden.tan()), center, size), hidden)
            }
            _ => return Err(BallPhotoError::FieldOfView(fov_degrees)),
        };
        let ball = BallView { center_camera: intrinsics.ray(center) / half_angle.sin(), radius: 1.0 };
        Ok(Self { frame, intrinsics, ball, reflectance: 1.0 })
    }

    /// Radiance from a direction (unit vector, camera space) in linear camera units, averaged over the texel that the
    /// offsets `across` and `down` to the neighboring directions span. Directions that the ball hides are filled from
    /// the ring around them.
    pub fn radiance(&self, dir: Vec3, across: Vec3, down: Vec3) -> Vec3 {
        let edge = self.ball.edge_angle(&self.intrinsics, EDGE_MARGIN_PIXELS);
        let axis = -self.ball.center_camera.normalize();
        let angle = axis.cross(dir).length().atan2(axis.dot(dir));
        let [pixel, right, below] = [dir, dir + across, dir + down].map(|d| self.pixel(d.normalize(), edge));
        let (right, below) = (right - pixel, below - pixel);
        let at_rim = smoothstep(edge - RIM[0], edge - RIM[1], angle);
        let sharpness = SHARP_BALL + (SMOOTH - SHARP_BALL) * at_rim;
        let count = Vec2::new(right.length(), below.length()).ceil().clamp(Vec2::ONE, Vec2::splat(MAX_SAMPLES));
        let mut sum = Vec3::ZERO;
        for j in 0..count.y as u32 {
            for i in 0..count.x as u32 {
                let offset = (Vec2::new(i as f32, j as f32) + 0.5) / count - 0.5;
                sum += self.sample(pixel + right * offset.x + below * offset.y, sharpness);
            }
        }
        let mean = sum / (count.x * count.y);
        let seen = (mean + self.leaked(pixel, [right, below], sharpness).clamp(-mean, mean)) / self.reflectance;
        if angle <= edge {
            return seen;
        }
        let side = (dir - axis * axis.dot(dir)).normalize_or(axis.any_orthonormal_vector());
        let other = axis.cross(side);
        let inward = (angle - edge) / (PI - edge);
        let ring = (0..RING).map(|i| {
            let (sin, cos) = (PI * inward * ((2 * i + 1) as f32 / RING as f32 - 1.0)).sin_cos();
            let rim = axis * edge.cos() + (side * cos + other * sin) * edge.sin();
            self.sample(self.pixel(rim, edge), SMOOTH)
        });
        ring.sum::<Vec3>() / (RING as f32 * self.reflectance)
    }

    /// Surroundings as an equirectangular map of a width in pixels (even, at least 2), in axes that are rotated against
    /// the camera's. Without rotation, the middle of the map is the direction from the ball back to the camera's side
    /// (+Z), and its left edge is the direction in which the camera looks.
    pub fn to_equirect(&self, width: u32, camera_from_map: Quat) -> EquirectPixels {
        let size = UVec2::new(width, width / 2).max(UVec2::new(2, 1));
        let direction = |pixel: Vec2| camera_from_map * equirect_direction(pixel / size.as_vec2());
        let texels = (0..size.x * size.y).map(|i| {
            let pixel = UVec2::new(i % size.x, i / size.x).as_vec2() + 0.5;
            let dir = direction(pixel);
            self.radiance(dir, direction(pixel + Vec2::X) - dir, direction(pixel + Vec2::Y) - dir)
        });
        EquirectPixels { size, texels: texels.collect() }
    }

    fn pixel(&self, dir: Vec3, edge: f32) -> Vec2 {
        self.intrinsics.project(self.ball.surface_point(dir, edge)).unwrap_or(self.intrinsics.center)
    }

    fn sample(&self, pixel: Vec2, sharpness: f32) -> Vec3 {
        between_pixels(pixel, sharpness, |x, y| self.frame.linear(x, y))
    }

    /// Twin of `leaked` in `unwrap/deconvolution.wgsl`.
    fn leaked(&self, pixel: Vec2, texel: [Vec2; 2], sharpness: f32) -> Vec3 {
        let spread = 1.0 / (12.0 * sharpness * sharpness) + (texel[0] * texel[0] + texel[1] * texel[1]) / 6.0;
        let leak = (LEAK * spread.map(f32::sqrt)).min(Vec2::splat(MAX_LEAK));
        let size = texel[0].perp_dot(texel[1]).abs().sqrt();
        let is_fine = ((COARSE[1] - size) / (COARSE[1] - COARSE[0])).clamp(0.0, 1.0);
        let weights = is_fine * leak / (1.0 - 2.0 * leak);
        between_pixels(pixel, sharpness, |x, y| {
            let at = |dx: i32, dy: i32| self.frame.linear(x + dx, y + dy);
            if self.frame.is_clipped(x, y) {
                return Vec3::ZERO;
            }
            let twice = 2.0 * at(0, 0);
            weights.x * (twice - at(-1, 0) - at(1, 0)) + weights.y * (twice - at(0, -1) - at(0, 1))
        })
    }
}

/// Interpolation between four pixels.
fn between_pixels(pixel: Vec2, sharpness: f32, value: impl Fn(i32, i32) -> Vec3) -> Vec3 {
    let corner = (pixel - 0.5).floor();
    let t = ((pixel - 1.0 - corner) * sharpness + 0.5).clamp(Vec2::ZERO, Vec2::ONE);
    let at = |dx: i32, dy: i32| value(corner.x as i32 + dx, corner.y as i32 + dy);
    at(0, 0).lerp(at(1, 0), t.x).lerp(at(0, 1).lerp(at(1, 1), t.x), t.y)
}

fn smoothstep(from: f32, to: f32, x: f32) -> f32 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{camera::FramePixels, probe::LinearPixels};

    #[test]
    fn an_outline_becomes_the_ball_that_has_it() {
        let frame = FramePixels::new(UVec2::new(640, 480), vec![128; 640 * 480 * 4]).expect("fits");
        for (center, fov) in
            [(Vec2::new(320.0, 240.0), 60.0), (Vec2::new(500.0, 120.0), 60.0), (Vec2::new(300.0, 250.0), 340.0)]
        {
            let photo = BallPhoto::from_outline(&frame, center, 120.0, fov).expect("possible");
            let outline = photo.ball.outline(&photo.intrinsics);
            // Perspective stretches the outline outwards and moves its center by a pixel or two.
            assert!(outline.center.distance(center) < 4.0 && (outline.semi_axes.y - 60.0).abs() < 1.0, "{outline:?}");
        }
        let far = BallPhoto::from_outline(&frame, Vec2::new(320.0, 240.0), 120.0, 360.0).expect("possible");
        assert!(far.ball.distance() > 100.0);
        let error = |fov, diameter| BallPhoto::from_outline(&frame, Vec2::ONE, diameter, fov).expect_err("impossible");
        let text = error(60.0, 6400.0).to_string();
        assert!(text.contains("6400 pixels") && text.contains("640 × 480"), "{text}");
        assert!(BallPhoto::from_outline(&frame, Vec2::new(320.0, 240.0), 640.0, 300.0).is_ok());
        assert!(error(180.0, 50.0).to_string().contains("180") && error(60.0, 0.0).to_string().contains("diameter"));
    }

    #[test]
    fn a_linear_photograph_shows_lamps_brighter_than_white() {
        let size = UVec2::new(160, 120);
        let frame = LinearPixels::new(size, vec![Vec3::new(40.0, 5.0, 0.25); 160 * 120]).expect("fits");
        let photo = BallPhoto::from_outline(&frame, Vec2::new(80.0, 60.0), 100.0, 300.0).expect("possible");
        let map = photo.to_equirect(32, Quat::IDENTITY);
        let expected = Vec3::new(40.0, 5.0, 0.25);
        assert!(map.texels.iter().all(|texel| texel.distance(expected) < 1e-3 * expected.x), "{:?}", map.texels[40]);
    }

    #[test]
    fn a_gray_ball_shows_a_gray_world_everywhere() {
        let frame = FramePixels::new(UVec2::new(160, 120), [188, 188, 188, 255].repeat(160 * 120)).expect("fits");
        let photo = BallPhoto::from_outline(&frame, Vec2::new(80.0, 60.0), 100.0, 300.0).expect("possible");
        let map = photo.to_equirect(32, Quat::IDENTITY);
        assert!(map.texels.iter().all(|texel| (*texel - 0.5029).abs().max_element() < 1e-3));
    }
}
