//! How much brighter than white the clipped pixels of a ball are, from the brightness of the marker's paper.

use super::BallView;
use crate::camera::{FramePixels, Intrinsics, srgb_to_linear};
use bevy::{math::Affine3A, prelude::*};

/// Recovery of light the camera clipped; on the entity of a [`LightProbeSphere`](super::LightProbeSphere).
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct ClipRecovery {
    /// Whether to recover at all; otherwise clipped light counts as white. Defaults to `true`.
    pub is_enabled: bool,
    /// Share of light the marker's white paper reflects, 0…1 (exclusive of 0). Defaults to 0.80, common office paper.
    pub paper_reflectance: f32,
    /// Upper bound of the gain. Defaults to 1000.
    pub max_gain: f32,
}

impl Default for ClipRecovery {
    fn default() -> Self {
        Self { is_enabled: true, paper_reflectance: 0.80, max_gain: 1000.0 }
    }
}

/// sRGB bytes from here on count as clipped; one step of noise below white still does.
pub(super) const CLIPPED_FROM: u8 = 254;
/// Clipped irradiance below this share of what the paper says cannot be told from noise; the gain is then 1.
const LEAST_CLIPPED_SHARE: f32 = 1e-3;
/// The picture of the ball ends this many pixels inside its silhouette, where pixels begin to mix with the background.
pub(super) const EDGE_MARGIN_PIXELS: f32 = 1.5;
/// Directions are looked up on a cube with this many cells along an edge (1.4° each, as fine as a ball 80 pixels wide).
const CUBE_EDGE: u32 = 64;

/// Irradiance at a surface divided by π, split by whether the camera had clipped what it came from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SplitIrradiance {
    pub unclipped: Vec3,
    pub clipped: Vec3,
}

impl SplitIrradiance {
    /// Cosine-weighted sum over the hemisphere about a normal (camera space) of what the ball shows.
    pub(super) fn at(
        normal_camera: Vec3,
        frame: &FramePixels,
        intrinsics: &Intrinsics,
        ball: &BallView,
        reflectance: f32,
        camera_from_world: &Affine3A,
    ) -> Self {
        let edge_angle = ball.edge_angle(intrinsics, EDGE_MARGIN_PIXELS);
        let mut sum = Self::default();
        let mut weight_sum = 0.0;
        for (dir_world, solid_angle) in cube_directions(CUBE_EDGE) {
            let dir_camera = camera_from_world.transform_vector3(dir_world);
            let weight = normal_camera.dot(dir_camera) * solid_angle;
            if weight <= 0.0 {
                continue;
            }
            weight_sum += weight;
            if let Some(pixel) = intrinsics.project(ball.surface_point(dir_camera, edge_angle)) {
                let (unclipped, clipped) = sample_split(frame, pixel);
                sum.unclipped += unclipped * weight;
                sum.clipped += clipped * weight;
            }
        }
        let scale = 1.0 / (weight_sum * reflectance);
        Self { unclipped: sum.unclipped * scale, clipped: sum.clipped * scale }
    }

    /// Gain on clipped light per channel that makes the whole equal to what the paper's radiance says.
    pub(super) fn gain(&self, paper: Vec3, recovery: &ClipRecovery) -> Vec3 {
        let wanted = paper / recovery.paper_reflectance;
        let gain = |channel: usize| {
            if self.clipped[channel] < LEAST_CLIPPED_SHARE * wanted[channel] || self.clipped[channel] <= 0.0 {
                return 1.0;
            }
            ((wanted[channel] - self.unclipped[channel]) / self.clipped[channel]).clamp(1.0, recovery.max_gain)
        };
        Vec3::new(gain(0), gain(1), gain(2))
    }
}

/// Centers and solid angles (steradian) of the cells of a cube map, in an unspecified order.
fn cube_directions(edge: u32) -> impl Iterator<Item = (Vec3, f32)> {
    let cell = 2.0 / edge as f32;
    (0..6 * edge * edge).map(move |i| {
        let (face, row, column) = (i / (edge * edge), i / edge % edge, i % edge);
        let (a, b) = ((column as f32 + 0.5) * cell - 1.0, (row as f32 + 0.5) * cell - 1.0);
        let sign = if face % 2 == 0 { 1.0 } else { -1.0 };
        let pos = match face / 2 {
            0 => Vec3::new(sign, a, b),
            1 => Vec3::new(a, sign, b),
            _ => Vec3::new(a, b, sign),
        };
        let length = pos.length();
        (pos / length, cell * cell / (length * length * length))
    })
}

/// Bilinear lookup at a pixel position, in linear camera units, split by whether the four pixels are clipped.
fn sample_split(frame: &FramePixels, pixel: Vec2) -> (Vec3, Vec3) {
    let corner = (pixel - 0.5).floor();
    let t = pixel - 0.5 - corner;
    let (x, y) = (corner.x as i32, corner.y as i32);
    let (mut unclipped, mut clipped) = (Vec3::ZERO, Vec3::ZERO);
    for (dx, dy, weight) in
        [(0, 0, (1.0 - t.x) * (1.0 - t.y)), (1, 0, t.x * (1.0 - t.y)), (0, 1, (1.0 - t.x) * t.y), (1, 1, t.x * t.y)]
    {
        for (channel, value) in frame.rgb8(x + dx, y + dy).into_iter().enumerate() {
            let part = if value >= CLIPPED_FROM { &mut clipped } else { &mut unclipped };
            part[channel] += weight * srgb_to_linear(value);
        }
    }
    (unclipped, clipped)
}

/// Radiance of a marker's white paper, in linear camera units: the median over the white margin around the black square.
///
/// `size` is the side of the black square, eight cells wide; the margin of one cell around it belongs to every tag36h11
/// marker. `None` if most of the margin is outside the picture.
pub(super) fn paper_radiance(
    frame: &FramePixels,
    intrinsics: &Intrinsics,
    camera_from_marker: &Affine3A,
    size: f32,
) -> Option<Vec3> {
    const STEPS: i32 = 36;
    let middle_of_margin = size * 4.5 / 8.0;
    let mut samples = Vec::with_capacity(4 * STEPS as usize);
    for step in 0..STEPS {
        let along = (2.0 * step as f32 / STEPS as f32 - 1.0) * middle_of_margin;
        let edges = [
            (along, middle_of_margin),
            (along, -middle_of_margin),
            (middle_of_margin, along),
            (-middle_of_margin, along),
        ];
        for (x, z) in edges {
            let pixel = intrinsics.project(camera_from_marker.transform_point3(Vec3::new(x, 0.0, z)));
            samples.extend(
                pixel
                    .filter(|p| p.cmpge(Vec2::ZERO).all() && p.cmplt(frame.size.as_vec2()).all())
                    .map(|p| frame.linear(p.x as i32, p.y as i32)),
            );
        }
    }
    (samples.len() > 2 * STEPS as usize).then(|| {
        let mut median = |channel: usize| {
            samples.sort_by(|a, b| a[channel].total_cmp(&b[channel]));
            samples[samples.len() / 2][channel]
        };
        Vec3::new(median(0), median(1), median(2))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cells_of_a_cube_cover_the_sphere() {
        let total: f32 = cube_directions(CUBE_EDGE).map(|(_, solid_angle)| solid_angle).sum();
        assert!((total - 4.0 * std::f32::consts::PI).abs() < 5e-3, "{total}");
    }

    #[test]
    fn the_gain_explains_the_paper() {
        let split = SplitIrradiance { unclipped: Vec3::new(0.2, 0.1, 0.3), clipped: Vec3::new(0.1, 0.0, 0.2) };
        let paper = Vec3::new(0.8, 0.4, 0.32);
        let gain = split.gain(paper, &ClipRecovery::default());
        // (0.8 / 0.8 - 0.2) / 0.1; nothing clipped; (0.32 / 0.8 - 0.3) / 0.2 is below 1.
        assert!(gain.abs_diff_eq(Vec3::new(8.0, 1.0, 1.0), 1e-5), "{gain}");
    }

    #[test]
    fn a_gray_room_lights_a_surface_with_its_own_radiance() {
        let size = UVec2::new(200, 200);
        let frame = FramePixels::new(size, [188, 188, 188, 255].repeat(40_000)).expect("fits");
        let intrinsics = Intrinsics::from_horizontal_fov(size, 0.4);
        let ball = BallView::new(Vec3::new(0.0, 0.0, -0.5), 0.05).expect("in front");
        let split = SplitIrradiance::at(Vec3::Y, &frame, &intrinsics, &ball, 0.5, &Affine3A::IDENTITY);
        assert!(split.unclipped.abs_diff_eq(Vec3::splat(2.0 * srgb_to_linear(188)), 1e-3), "{split:?}");
        assert_eq!(split.clipped, Vec3::ZERO);
    }
}
