//! A printed sheet of A4 in landscape with four fields, and a camera that looks at its middle.
//!
//! Places on the sheet are meters: X to the right, Y to the player, and height above the paper. Pixels count from the
//! upper left corner of the frame.

use super::dots::DotGrid;
use glam::{Vec2, Vec3, Vec3Swizzles};

/// Size of the sheet.
const SHEET: Vec2 = Vec2::new(0.297, 0.21);
/// Size of each field.
const FIELD: Vec2 = Vec2::new(0.06, 0.08);
/// Middles of the fields: left, down, up, right.
pub(super) const FIELDS: [Vec2; 4] =
    [Vec2::new(-0.105, 0.06), Vec2::new(-0.035, 0.06), Vec2::new(0.035, 0.06), Vec2::new(0.105, 0.06)];

/// The dots of each field.
pub(super) fn grid() -> DotGrid {
    DotGrid::new(FIELD)
}

/// Fraction of ink (0 or 1) at a place on the sheet; `None` beside the sheet.
pub(super) fn ink_at(place: Vec2) -> Option<f32> {
    if (place.abs() * 2.0).cmpgt(SHEET).any() {
        return None;
    }
    let grid = grid();
    let in_field = FIELDS.iter().map(|middle| place - middle).find(|p| (p.abs() * 2.0).cmple(FIELD).all());
    let is_dot =
        in_field.is_some_and(|p| grid.centers().any(|center| center.distance_squared(p) <= grid.dot_radius().powi(2)));
    Some(if is_dot { 1.0 } else { 0.0 })
}

/// A camera without distortion.
#[derive(Clone, Copy, Debug)]
pub(super) struct SheetView {
    pub(super) size: Vec2,
    focal: f32,
    pub(super) position: Vec3,
    right: Vec3,
    down: Vec3,
    forward: Vec3,
}

impl SheetView {
    /// Where most players have their camera: 45 cm above the sheet's middle and 45 cm in front of it, 60° wide.
    pub(super) fn usual(width: f32) -> Self {
        Self::around(width, 0.636, 45.0, 0.0)
    }

    /// `width` of the frame in pixels, at 4:3; distance to the sheet's middle in meters; degrees above the desk and
    /// around the sheet, 0° on the player's side.
    pub(super) fn around(width: f32, distance: f32, elevation: f32, around: f32) -> Self {
        let (sin, cos) = elevation.to_radians().sin_cos();
        let (aside, back) = around.to_radians().sin_cos();
        Self {
            size: Vec2::new(width, 0.75 * width),
            focal: 0.5 * width / 30f32.to_radians().tan(),
            position: distance * Vec3::new(aside * cos, back * cos, sin),
            right: Vec3::new(back, -aside, 0.0),
            down: Vec3::new(aside * sin, back * sin, -cos),
            forward: -Vec3::new(aside * cos, back * cos, sin),
        }
    }

    /// The same camera turned, so that the picture moves by pixels.
    pub(super) fn turned(self, pixels: Vec2) -> Self {
        let forward = (self.forward * self.focal - self.right * pixels.x - self.down * pixels.y).normalize();
        let right = (self.right - forward * forward.dot(self.right)).normalize();
        let down = (self.down - forward * forward.dot(self.down) - right * right.dot(self.down)).normalize();
        Self { forward, right, down, ..self }
    }

    /// Pixel of a point: place and height.
    pub(super) fn project(&self, point: Vec3) -> Option<Vec2> {
        let p = point - self.position;
        let depth = p.dot(self.forward);
        (depth > 0.0).then(|| 0.5 * self.size + Vec2::new(p.dot(self.right), p.dot(self.down)) * (self.focal / depth))
    }

    /// Direction in which a pixel looks.
    pub(super) fn ray(&self, pixel: Vec2) -> Vec3 {
        let p = (pixel - 0.5 * self.size) / self.focal;
        (self.forward + p.x * self.right + p.y * self.down).normalize()
    }

    /// Place on the sheet's plane that a pixel shows.
    pub(super) fn place(&self, ray: Vec3) -> Vec2 {
        (self.position + ray * (self.position.z / -ray.z.min(-1e-3))).xy()
    }

    /// Upper left and lower right pixel of what has to be rendered: all fields, with some surroundings.
    pub(super) fn region(&self) -> (usize, usize, usize, usize) {
        let corners = FIELDS.iter().flat_map(|middle| {
            [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)].map(|(x, y)| *middle + 0.5 * FIELD * Vec2::new(x, y))
        });
        let pixels: Vec<Vec2> = corners.filter_map(|corner| self.project(corner.extend(0.0))).collect();
        let low = pixels.iter().copied().fold(Vec2::MAX, Vec2::min) - 8.0;
        let high = pixels.iter().copied().fold(Vec2::MIN, Vec2::max) + 8.0;
        let (low, high) = (low.clamp(Vec2::ZERO, self.size), high.clamp(Vec2::ZERO, self.size));
        (low.x as usize, low.y as usize, high.x as usize, high.y as usize)
    }
}
