//! Edges of real shadows: how much darker the desk is on the inner side of the outline that a light would throw.
//!
//! A small light throws shadows with sharp edges, and a wide one does not. Whether there is a small light in a
//! direction therefore follows from the brightness on both sides of the edges of the shadows that balls and phantoms
//! would throw from there. The albedo cancels, because both sides are a few pixels apart on one surface.

use super::{
    desk_frame::{DeskFrame, DeskGeometry, MirrorBall},
    ray_cast::{SURFACE_OFFSET, sphere_is_hit},
    sample_points::is_on_sheet,
    silhouettes::{OutlinePoint, Silhouettes},
};
use glam::Vec3;

/// Distance of the compared points from the edge, in pixels: close by, and at a distance at which the edge of a light
/// some 2° beside the tried direction lies in between.
const WIDTHS: [f32; 2] = [2.5, 6.0];
/// Smallest distance between an outline and its shadow, in units of the smaller width. Even wide lights throw sharp
/// edges where a solid stands on the desk.
const MIN_SHADOW_DISTANCE: f32 = 16.0;
/// Smallest cosine at which light falls onto a surface that is used.
const MIN_LIGHT_COSINE: f32 = 0.15;
/// Largest distance between a surface and the surface of the same phantom that the camera sees, meters.
const MAX_DEPTH_ERROR: f32 = 3e-3;
/// Brightness, in linear camera units, above which a pixel may be clipped and below which it is noise.
const USABLE: std::ops::Range<f32> = 0.01..0.95;
/// Largest step, as a logarithm, that counts in full. Limits the influence of prints.
const MAX_STEP: f32 = 1.5;

/// Brightness steps across the edges of shadows from one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct EdgeEvidence {
    /// Number of compared places.
    pub count: usize,
    /// Logarithm of the ratio of brightness outside ÷ inside, close to the edge: mean without the extremes.
    pub narrow: f32,
    /// The same at the larger distance.
    pub wide: f32,
    /// Standard error of `narrow`.
    pub error: f32,
    /// Typical angle that the smaller distance subtends at the solid that throws the shadow, radians.
    pub resolution: f32,
}

/// The desk in a frame with the outlines of what stands on it.
pub(super) struct ShadowEdges<'a> {
    desk: &'a DeskFrame,
    geometry: DeskGeometry<'a>,
    silhouettes: Silhouettes,
    eye: Vec3,
}

impl<'a> ShadowEdges<'a> {
    pub(super) fn new(desk: &'a DeskFrame, geometry: DeskGeometry<'a>) -> Self {
        let eye = Vec3::from(desk.camera_from_world.inverse().translation);
        Self { desk, geometry, silhouettes: Silhouettes::new(geometry), eye }
    }

    /// Brightness steps that the frame shows where a light in a direction would throw the edges of shadows, from some
    /// `points` points of the outlines.
    pub(super) fn evidence(&self, dir: Vec3, points: usize) -> EdgeEvidence {
        let mut guesses = vec![0; self.geometry.phantoms.len()];
        let outline = self.silhouettes.outline(dir, points);
        let steps: Vec<[f32; 3]> =
            outline.into_iter().filter_map(|point| self.steps_at(point, dir, &mut guesses)).collect();
        let [narrow, wide, resolution] = [0, 1, 2].map(|k| steps.iter().map(|step| step[k]).collect::<Vec<f32>>());
        let (narrow, error) = trimmed_mean(narrow);
        let [(wide, _), (resolution, _)] = [wide, resolution].map(trimmed_mean);
        EdgeEvidence { count: steps.len(), narrow, wide, error, resolution }
    }

    /// Both steps at the shadow of one point of an outline, and the angle that the smaller distance subtends; `None` if
    /// the camera does not see it or other shadows cover it.
    fn steps_at(&self, outline: OutlinePoint, dir: Vec3, guesses: &mut [usize]) -> Option<[f32; 3]> {
        let pixel = outline.pos.distance(self.eye) / self.desk.intrinsics.focal.x;
        let [near, far] = WIDTHS.map(|width| width * pixel);
        let from = outline.pos + far * outline.outward;
        let (receiver, distance, normal) = self.nearest_phantom(from, -dir)?;
        let cosine = normal.dot(dir);
        let receives = self.geometry.phantoms[receiver].receives;
        if !receives || distance < MIN_SHADOW_DISTANCE * near || cosine < MIN_LIGHT_COSINE {
            return None;
        }
        let foot = from - distance * dir;
        let on_surface = |offset: f32| {
            let from = outline.pos + offset * outline.outward;
            from - dir * ((from - foot).dot(normal) / cosine)
        };
        let (inside, outside) = (on_surface(-far), on_surface(far));
        let is_usable =
            |p: Vec3| !self.geometry.papers.iter().any(|paper| is_on_sheet(paper, p)) && self.is_in_view(p, receiver);
        let lift = SURFACE_OFFSET * normal;
        let has_edge = self.geometry.is_hidden(inside + lift, dir, guesses)
            && !self.geometry.is_hidden(outside + lift, dir, guesses);
        if !has_edge || !is_usable(inside) || !is_usable(outside) {
            return None;
        }
        let step = |width: f32| {
            let ratio = self.gray_at(on_surface(width))? / self.gray_at(on_surface(-width))?;
            Some(ratio.ln().clamp(-MAX_STEP, MAX_STEP))
        };
        Some([step(near)?, step(far)?, near / distance])
    }

    /// Index, distance and normal of the nearest phantom along a ray.
    fn nearest_phantom(&self, origin: Vec3, dir: Vec3) -> Option<(usize, f32, Vec3)> {
        let hits = self.geometry.phantoms.iter().enumerate();
        hits.filter_map(|(k, phantom)| phantom.hit(origin, dir).map(|(distance, normal)| (k, distance, normal)))
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Whether the camera sees a point of a phantom.
    fn is_in_view(&self, point: Vec3, phantom: usize) -> bool {
        let (ray, distance) = (point - self.eye).normalize_and_length();
        let is_behind_ball = |ball: &MirrorBall| sphere_is_hit(ball.center - self.eye, 1.05 * ball.radius, ray);
        !self.geometry.balls.iter().any(is_behind_ball)
            && self
                .nearest_phantom(self.eye, ray)
                .is_some_and(|(k, hit, _)| k == phantom && (hit - distance).abs() < MAX_DEPTH_ERROR)
    }

    /// Mean of the channels in 3 × 3 pixels around a point; `None` outside of the frame and where it is not usable.
    fn gray_at(&self, point: Vec3) -> Option<f32> {
        let frame = &self.desk.frame;
        let pixel = self.desk.intrinsics.project(self.desk.camera_from_world.transform_point3(point))?;
        let (x, y) = (pixel.x.floor() as i32, pixel.y.floor() as i32);
        let size = frame.size.as_ivec2();
        if x < 1 || y < 1 || x + 1 >= size.x || y + 1 >= size.y {
            return None;
        }
        let mut sum = Vec3::ZERO;
        for i in 0..9 {
            let value = frame.linear(x + i % 3 - 1, y + i / 3 - 1);
            if value.max_element() > USABLE.end {
                return None;
            }
            sum += value;
        }
        Some(sum.element_sum() / 27.0).filter(|gray| *gray > USABLE.start)
    }
}

/// Mean of the middle 60 % of values, and its standard error.
fn trimmed_mean(mut values: Vec<f32>) -> (f32, f32) {
    values.sort_by(f32::total_cmp);
    let n = values.len();
    let core = &values[n / 5..n - n / 5];
    if core.is_empty() {
        return (0.0, f32::INFINITY);
    }
    let mean = core.iter().sum::<f32>() / core.len() as f32;
    // The middle 60 % of normally distributed values span 1.68 standard deviations.
    let deviation = (core[core.len() - 1] - core[0]) / 1.68;
    (mean, deviation.max(1e-3) / (n as f32).sqrt())
}
