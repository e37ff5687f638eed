//! Sample points on the paper and on phantoms, and their brightness in a frame.

use super::{
    desk_frame::{DeskGeometry, Paper},
    ray_cast::sphere_is_hit,
};
use crate::{
    camera::{FramePixels, Intrinsics},
    probe::{MARGIN_CELLS, SQUARE_CELLS},
};
use glam::{Affine3A, Vec2, Vec3};

/// Surface that a point belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Surface {
    Paper,
    Phantom(usize),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SamplePoint {
    pub pos_world: Vec3,
    pub normal_world: Vec3,
    pub surface: Surface,
    /// Fraction of light that the surface reflects, if known.
    pub reflectance: Option<Vec3>,
}

/// Largest number of points on phantoms.
pub(super) const MAX_PHANTOM_POINTS: usize = 700;
/// Points along each side of a sheet.
const PAPER_STEPS: i32 = 9;
/// Smallest margin of a sheet around its black square, in sides of the square.
const SHEET_MARGIN: f32 = 0.14;
/// Smallest cosine between the surface normal and the direction to the camera at which a surface is used.
const MIN_VIEW_COSINE: f32 = 0.2;

pub(super) fn paper_points(papers: &[Paper]) -> Vec<SamplePoint> {
    let mut points = Vec::new();
    for paper in papers {
        let middle_of_margin = paper.size * MARGIN_CELLS / SQUARE_CELLS;
        let normal_world = paper.world_from_marker.transform_vector3(Vec3::Y).normalize_or_zero();
        for step in 0..PAPER_STEPS {
            let along = (2.0 * step as f32 / PAPER_STEPS as f32 - 1.0) * middle_of_margin;
            let sides = [
                (along, middle_of_margin),
                (-along, -middle_of_margin),
                (middle_of_margin, -along),
                (-middle_of_margin, along),
            ];
            points.extend(sides.map(|(x, z)| SamplePoint {
                pos_world: paper.world_from_marker.transform_point3(Vec3::new(x, 0.0, z)),
                normal_world,
                surface: Surface::Paper,
                reflectance: Some(Vec3::splat(paper.reflectance)),
            }));
        }
    }
    points
}

pub(super) fn phantom_points(
    geometry: DeskGeometry,
    intrinsics: &Intrinsics,
    camera_from_world: &Affine3A,
) -> Vec<SamplePoint> {
    let world_from_camera = camera_from_world.inverse();
    let eye: Vec3 = world_from_camera.translation.into();
    let size = intrinsics.size.as_vec2();
    // Twice as many as are kept, because some rays miss.
    let spacing = (size.element_product() / (2 * MAX_PHANTOM_POINTS) as f32).sqrt();
    let counts = (size / spacing).as_uvec2();
    let mut points = Vec::new();
    for i in 0..counts.element_product() {
        let pixel = (Vec2::new((i % counts.x) as f32, (i / counts.x) as f32) + 0.5) * spacing;
        let ray = world_from_camera.transform_vector3(intrinsics.ray(pixel)).normalize();
        if geometry.balls.iter().any(|ball| sphere_is_hit(ball.center - eye, 1.05 * ball.radius, ray)) {
            continue;
        }
        let nearest = geometry
            .phantoms
            .iter()
            .enumerate()
            .filter_map(|(k, phantom)| phantom.hit(eye, ray).map(|(distance, normal)| (k, distance, normal)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((k, distance, normal_world)) = nearest else {
            continue;
        };
        let pos_world = eye + distance * ray;
        let is_usable = geometry.phantoms[k].receives
            && -normal_world.dot(ray) > MIN_VIEW_COSINE
            && !geometry.papers.iter().any(|paper| is_on_sheet(paper, pos_world));
        if is_usable {
            let reflectance = geometry.phantoms[k].reflectance;
            points.push(SamplePoint { pos_world, normal_world, surface: Surface::Phantom(k), reflectance });
        }
    }
    let step = points.len().div_ceil(MAX_PHANTOM_POINTS).max(1);
    points.into_iter().step_by(step).collect()
}

pub(super) fn is_on_sheet(paper: &Paper, pos_world: Vec3) -> bool {
    let pos = paper.world_from_marker.inverse().transform_point3(pos_world);
    pos.y.abs() < 0.01 && pos.x.abs().max(pos.z.abs()) < (0.5 + SHEET_MARGIN) * paper.size
}

/// Half width of the square of pixels around a point, in pixels.
const WINDOW_RADIUS: i32 = 3;
/// Largest difference between quarters of the square: relative to the brightest one, and in linear camera units. Beyond
/// it, the square contains an edge.
const MAX_CONTRAST: (f32, f32) = (0.08, 0.01);

/// Radiance of a frame around a pixel, per channel: the mean of the middle half of the values; NaN where clipped.
/// `None` across edges and outside of the frame.
pub(super) fn sample_radiance(frame: &FramePixels, pixel: Vec2) -> Option<Vec3> {
    let (x, y) = (pixel.x as i32, pixel.y as i32);
    let size = frame.size.as_ivec2();
    if x < WINDOW_RADIUS || y < WINDOW_RADIUS || x + WINDOW_RADIUS >= size.x || y + WINDOW_RADIUS >= size.y {
        return None;
    }
    let mut values: [Vec<f32>; 3] = Default::default();
    let mut quarters = [(0.0_f32, 0.0_f32); 4];
    for dy in -WINDOW_RADIUS..=WINDOW_RADIUS {
        for dx in -WINDOW_RADIUS..=WINDOW_RADIUS {
            let value = frame.linear(x + dx, y + dy);
            for (channel, value) in values.iter_mut().zip(value.to_array()) {
                channel.push(value);
            }
            if dx != 0 && dy != 0 {
                let quarter = &mut quarters[usize::from(dx > 0) + 2 * usize::from(dy > 0)];
                // Limits the influence of fireflies and dust, which must not look like an edge.
                quarter.0 += value.element_sum().min(3.0).sqrt();
                quarter.1 += 1.0;
            }
        }
    }
    let means = quarters.map(|(sum, count)| (sum / count).powi(2) / 3.0);
    let (low, high) = means.into_iter().fold((f32::MAX, 0.0_f32), |(low, high), m| (low.min(m), high.max(m)));
    if high - low > MAX_CONTRAST.0 * high + MAX_CONTRAST.1 {
        return None;
    }
    Some(Vec3::from_array(values.map(|mut channel| {
        channel.sort_by(f32::total_cmp);
        let (from, to) = (channel.len() / 4, channel.len() - channel.len() / 4);
        let mean = channel[from..to].iter().sum::<f32>() / (to - from) as f32;
        if channel[to - 1] > MAX_UNCLIPPED { f32::NAN } else { mean }
    })))
}

/// Radiance above which a surface may be partly clipped, linear camera units.
const MAX_UNCLIPPED: f32 = 0.97;
