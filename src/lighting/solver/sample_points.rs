//! Sample points on the paper and on phantoms, and their brightness in a frame.

use super::{
    desk_frame::{DeskGeometry, Paper},
    ray_cast::sphere_is_hit,
};
use crate::{
    camera::{FramePixels, Intrinsics},
    probe::{MARGIN_CELLS, SQUARE_CELLS},
};
use bevy::math::Rect;
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
/// Number of points on a phantom from which on it needs no finer grid.
const POINTS_ON_SMALL_PHANTOM: usize = 100;
/// Smallest distance of points, in pixels: their surroundings do not overlap.
const MIN_SPACING: f32 = 8.0;
/// Points along each side of a sheet.
const PAPER_STEPS: i32 = 9;
/// Distance of the middle of the black border from the middle of a marker, in cells.
const INK_CELLS: f32 = 3.5;
/// Smallest margin of a sheet around its black square, in sides of the square.
const SHEET_MARGIN: f32 = 0.14;
/// Smallest cosine between the surface normal and the direction to the camera at which a surface is used.
const MIN_VIEW_COSINE: f32 = 0.2;

pub(super) fn paper_points(papers: &[Paper]) -> Vec<SamplePoint> {
    let point = |paper: &Paper, pos_world| SamplePoint {
        pos_world,
        normal_world: paper.world_from_marker.transform_vector3(Vec3::Y).normalize_or_zero(),
        surface: Surface::Paper,
        reflectance: Some(Vec3::splat(paper.reflectance)),
    };
    papers.iter().flat_map(|paper| ring(paper, MARGIN_CELLS).map(move |pos_world| point(paper, pos_world))).collect()
}

/// Places in world space on the black border of a marker.
pub(super) fn ink_places(paper: &Paper) -> impl Iterator<Item = Vec3> + use<'_> {
    ring(paper, INK_CELLS)
}

/// Places in world space around the middle of a sheet, at a distance in cells of the marker.
fn ring(paper: &Paper, cells: f32) -> impl Iterator<Item = Vec3> + use<'_> {
    let radius = paper.size * cells / SQUARE_CELLS;
    (0..PAPER_STEPS).flat_map(move |step| {
        let along = (2.0 * step as f32 / PAPER_STEPS as f32 - 1.0) * radius;
        let sides = [(along, radius), (-along, -radius), (radius, -along), (-radius, along)];
        sides.map(|(x, z)| paper.world_from_marker.transform_point3(Vec3::new(x, 0.0, z)))
    })
}

/// Points on a grid of pixels: dense on small things, because the faces of a box tell more of the light than as many
/// pixels of the desk.
pub(super) fn phantom_points(
    geometry: DeskGeometry,
    intrinsics: &Intrinsics,
    camera_from_world: &Affine3A,
) -> Vec<SamplePoint> {
    let sampler = Sampler { geometry, intrinsics, world_from_camera: camera_from_world.inverse() };
    let picture = Rect::from_corners(Vec2::ZERO, intrinsics.size.as_vec2());
    // Twice as many as are kept, because some rays miss.
    let spacing = spacing_for(picture, 2 * MAX_PHANTOM_POINTS);
    let mut by_phantom = vec![Vec::new(); geometry.phantoms.len()];
    for found in sampler.points_in(picture, spacing) {
        by_phantom[found.phantom].push(found);
    }
    let small = by_phantom.iter().filter(|found| (1..POINTS_ON_SMALL_PHANTOM).contains(&found.len())).count();
    let quota = POINTS_ON_SMALL_PHANTOM.min(MAX_PHANTOM_POINTS / 2 / small.max(1));
    for (phantom, found) in by_phantom.iter_mut().enumerate() {
        let Some(first) = found.first().filter(|_| found.len() < quota) else { continue };
        let part = found.iter().fold(Rect::from_center_size(first.pixel, Vec2::ZERO), |r, f| r.union_point(f.pixel));
        let part = part.inflate(spacing).intersect(picture);
        let finer = sampler.points_in(part, spacing_for(part, 2 * quota).max(MIN_SPACING)).into_iter();
        let finer: Vec<FoundPoint> = finer.filter(|f| f.phantom == phantom).collect();
        if finer.len() > found.len() {
            *found = finer;
        }
    }
    let (small, large): (Vec<_>, Vec<_>) = by_phantom.into_iter().partition(|found| found.len() <= 2 * quota);
    let small = thinned(small.into_iter().flatten().collect(), MAX_PHANTOM_POINTS / 2);
    let large = thinned(large.into_iter().flatten().collect(), MAX_PHANTOM_POINTS - small.len());
    small.into_iter().chain(large).map(|found| found.point).collect()
}

/// At most so many of the points, evenly chosen.
fn thinned(points: Vec<FoundPoint>, max_points: usize) -> Vec<FoundPoint> {
    let step = points.len().div_ceil(max_points.max(1)).max(1);
    points.into_iter().step_by(step).collect()
}

/// Distance of the pixels of a grid.
fn spacing_for(part: Rect, points: usize) -> f32 {
    (part.size().element_product() / points as f32).sqrt()
}

/// A point of a phantom and where the frame shows it.
#[derive(Clone)]
struct FoundPoint {
    phantom: usize,
    pixel: Vec2,
    point: SamplePoint,
}

struct Sampler<'a> {
    geometry: DeskGeometry<'a>,
    intrinsics: &'a Intrinsics,
    world_from_camera: Affine3A,
}

impl Sampler<'_> {
    /// Usable points on a grid in a part of the picture.
    fn points_in(&self, part: Rect, spacing: f32) -> Vec<FoundPoint> {
        let counts = (part.size() / spacing).as_uvec2();
        let place = |i: u32| part.min + (Vec2::new((i % counts.x) as f32, (i / counts.x) as f32) + 0.5) * spacing;
        (0..counts.element_product()).filter_map(|i| self.point_at(place(i))).collect()
    }

    fn point_at(&self, pixel: Vec2) -> Option<FoundPoint> {
        let DeskGeometry { balls, papers, phantoms } = self.geometry;
        let eye: Vec3 = self.world_from_camera.translation.into();
        let ray = self.world_from_camera.transform_vector3(self.intrinsics.ray(pixel)).normalize();
        if balls.iter().any(|ball| sphere_is_hit(ball.center - eye, 1.05 * ball.radius, ray)) {
            return None;
        }
        let hits = phantoms.iter().enumerate().filter_map(|(k, phantom)| Some((k, phantom.hit(eye, ray)?)));
        let (phantom, (distance, normal_world)) = hits.min_by(|(_, a), (_, b)| a.0.total_cmp(&b.0))?;
        let pos_world = eye + distance * ray;
        let is_usable = phantoms[phantom].receives
            && -normal_world.dot(ray) > MIN_VIEW_COSINE
            && !papers.iter().any(|paper| is_on_sheet(paper, pos_world));
        let (surface, reflectance) = (Surface::Phantom(phantom), phantoms[phantom].reflectance);
        let point = SamplePoint { pos_world, normal_world, surface, reflectance };
        is_usable.then_some(FoundPoint { phantom, pixel, point })
    }
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
