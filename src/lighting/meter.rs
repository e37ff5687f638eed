//! Points of the desk that tell how bright the light is: which part of the sky each of them sees.

use super::{
    mirrored_sky::MirroredSky,
    ray_cast::{PhantomSolid, SURFACE_OFFSET, sphere_is_hit},
    sky::SkyCell,
};
use crate::{
    camera::{FramePixels, Intrinsics},
    probe::{BallSurface, MARGIN_CELLS, SQUARE_CELLS},
};
use bevy::{math::Affine3A, prelude::*};

/// A marker's printed sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paper {
    /// Marker frame → world.
    pub world_from_marker: Affine3A,
    /// Side of the black square in metres.
    pub size: f32,
    /// Share of light the white margin reflects, 0…1.
    pub reflectance: f32,
}

/// A mirrored ball on the desk, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorBall {
    /// Center, metres.
    pub center: Vec3,
    /// Radius in metres.
    pub radius: f32,
    /// Share of light it mirrors, 0…1; perpendicular to its surface if that depends on the angle.
    pub reflectance: f32,
    /// Whether it does.
    pub surface: BallSurface,
}

/// What a point belongs to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Surface {
    Paper,
    Phantom(usize),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeterPoint {
    pub pos_world: Vec3,
    pub normal_world: Vec3,
    pub surface: Surface,
    /// Share of light it reflects, if known.
    pub reflectance: Option<Vec3>,
}

/// Points and the light that can reach them. Depends on where things stand, not on the light.
#[derive(Clone, Debug, Default)]
pub(super) struct Meter {
    pub points: Vec<MeterPoint>,
    /// Per point and cell of the sky: irradiance per radiance, steradian. Directly, and by way of the ball.
    pub weights: Vec<f32>,
    /// Per point: phantoms in view with the steradian they take.
    pub hidden: Vec<Vec<(usize, f32)>>,
    /// Per point: the sky's images in the balls beside it.
    pub mirrored: Vec<Vec<MirroredSky>>,
}

/// What stands on the desk.
#[derive(Clone, Copy)]
pub(super) struct Desk<'a> {
    pub balls: &'a [MirrorBall],
    pub papers: &'a [Paper],
    pub phantoms: &'a [PhantomSolid],
}

/// Points on phantoms, at most.
const MOST_POINTS: usize = 700;
/// Points along each side of a sheet.
const PAPER_STEPS: i32 = 9;
/// A sheet of paper is at least this much wider than its black square, on each side, as a share of the square's side.
const SHEET_MARGIN: f32 = 0.14;
/// Surfaces seen at a flatter angle tell nothing; cosine.
const LEAST_VIEW_COSINE: f32 = 0.2;

impl Meter {
    /// Picks points in view of the camera and traces what they see. Takes the memory of an earlier table.
    pub(super) fn new(
        mut memory: Vec<f32>,
        desk: Desk,
        intrinsics: &Intrinsics,
        camera_from_world: &Affine3A,
        sky: &[SkyCell],
    ) -> Self {
        let mut points = paper_points(desk.papers);
        let most = points.len() + MOST_POINTS;
        points.extend(phantom_points(desk, intrinsics, camera_from_world));
        memory.clear();
        memory.reserve_exact(most * sky.len());
        let mut meter = Self { weights: memory, hidden: Vec::new(), mirrored: Vec::new(), points };
        for i in 0..meter.points.len() {
            meter.trace(i, desk, sky);
        }
        meter
    }

    fn trace(&mut self, i: usize, desk: Desk, sky: &[SkyCell]) {
        let point = self.points[i];
        let origin = point.pos_world + SURFACE_OFFSET * point.normal_world;
        let mirrored: Vec<MirroredSky> =
            desk.balls.iter().filter_map(|ball| MirroredSky::new(origin, point.normal_world, ball)).collect();
        let mut hiding: Vec<Hiding> = (desk.phantoms.iter().enumerate())
            .filter(|(_, phantom)| phantom.casts && phantom.is_above(origin, point.normal_world))
            .map(|(place, phantom)| Hiding { place, phantom, guess: 0, share: 0.0 })
            .collect();
        for cell in sky {
            let cosine = cell.dir_world.dot(point.normal_world);
            let mut weight = 0.0;
            if cosine > 0.0 && !desk.ball_hides(origin, cell.dir_world) {
                match nearest_hiding(&mut hiding, origin, cell.dir_world) {
                    Some(hiding) => hiding.share += cosine * cell.solid_angle,
                    None => weight = cosine * cell.solid_angle,
                }
            }
            for mirrored in &mirrored {
                weight += mirrored.weight(cell);
            }
            self.weights.push(weight);
        }
        self.mirrored.push(mirrored);
        self.hidden.push(hiding.iter().filter(|h| h.share > 0.0).map(|h| (h.place, h.share)).collect());
    }
}

/// A phantom that may hide a part of the sky from a point.
struct Hiding<'a> {
    place: usize,
    phantom: &'a PhantomSolid,
    /// The triangle that was hit last.
    guess: usize,
    /// What it hides, steradian weighted by the cosine.
    share: f32,
}

fn nearest_hiding<'b, 'a>(hiding: &'b mut [Hiding<'a>], origin: Vec3, dir: Vec3) -> Option<&'b mut Hiding<'a>> {
    let mut nearest: Option<usize> = None;
    for k in 0..hiding.len() {
        let Hiding { phantom, guess, .. } = &mut hiding[k];
        if !phantom.is_hit(origin, dir, guess) {
            continue;
        }
        // How far away they are counts where one stands behind the other only.
        let distance = |k: usize| hiding[k].phantom.hit(origin, dir).map_or(f32::MAX, |(distance, _)| distance);
        nearest = Some(nearest.filter(|&other| distance(other) <= distance(k)).unwrap_or(k));
    }
    nearest.map(|k| &mut hiding[k])
}

/// What a light at a finite distance sends to points of the desk.
pub(super) struct NearLight<'a> {
    pub desk: Desk<'a>,
    /// Where its rays to the camera were mirrored, world space.
    pub origin: Vec3,
    /// From there, metres.
    pub distance: f32,
}

impl NearLight<'_> {
    /// Irradiance per radiance of cells at a point: directly, in place of the light from far away, and by way of the balls.
    pub(super) fn weights(
        &self,
        point: &MeterPoint,
        mirrored: &[MirroredSky],
        cells: impl Iterator<Item = SkyCell>,
    ) -> Vec<f32> {
        let from = point.pos_world + SURFACE_OFFSET * point.normal_world;
        let mut guesses = vec![0; self.desk.phantoms.len()];
        cells
            .map(|cell| {
                let to_light = self.origin + self.distance * cell.dir_world - from;
                let distance = to_light.length().max(1e-3);
                let dir = to_light / distance;
                let solid_angle = cell.solid_angle * (self.distance / distance).powi(2);
                let cosine = dir.dot(point.normal_world);
                let is_lit = cosine > 0.0 && !self.desk.hides(from, dir, &mut guesses);
                let direct = if is_lit { cosine * solid_angle } else { 0.0 };
                direct + mirrored.iter().map(|mirrored| mirrored.weight(&cell)).sum::<f32>()
            })
            .collect()
    }
}

impl Desk<'_> {
    fn ball_hides(&self, origin: Vec3, dir: Vec3) -> bool {
        self.balls.iter().any(|ball| sphere_is_hit(ball.center - origin, ball.radius, dir))
    }

    fn hides(&self, origin: Vec3, dir: Vec3, guesses: &mut [usize]) -> bool {
        let mut phantoms = self.phantoms.iter().zip(guesses);
        self.ball_hides(origin, dir)
            || phantoms.any(|(phantom, guess)| phantom.casts && phantom.is_hit(origin, dir, guess))
    }
}

pub(super) fn paper_points(papers: &[Paper]) -> Vec<MeterPoint> {
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
            points.extend(sides.map(|(x, z)| MeterPoint {
                pos_world: paper.world_from_marker.transform_point3(Vec3::new(x, 0.0, z)),
                normal_world,
                surface: Surface::Paper,
                reflectance: Some(Vec3::splat(paper.reflectance)),
            }));
        }
    }
    points
}

fn phantom_points(desk: Desk, intrinsics: &Intrinsics, camera_from_world: &Affine3A) -> Vec<MeterPoint> {
    let world_from_camera = camera_from_world.inverse();
    let eye: Vec3 = world_from_camera.translation.into();
    let size = intrinsics.size.as_vec2();
    // Twice as many as are kept: some rays miss.
    let spacing = (size.element_product() / (2 * MOST_POINTS) as f32).sqrt();
    let counts = (size / spacing).as_uvec2();
    let mut points = Vec::new();
    for i in 0..counts.element_product() {
        let pixel = (Vec2::new((i % counts.x) as f32, (i / counts.x) as f32) + 0.5) * spacing;
        let ray = world_from_camera.transform_vector3(intrinsics.ray(pixel)).normalize();
        if desk.balls.iter().any(|ball| sphere_is_hit(ball.center - eye, 1.05 * ball.radius, ray)) {
            continue;
        }
        let nearest = desk
            .phantoms
            .iter()
            .enumerate()
            .filter_map(|(k, phantom)| phantom.hit(eye, ray).map(|(distance, normal)| (k, distance, normal)))
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((k, distance, normal_world)) = nearest else {
            continue;
        };
        let pos_world = eye + distance * ray;
        let is_usable = desk.phantoms[k].receives
            && -normal_world.dot(ray) > LEAST_VIEW_COSINE
            && !desk.papers.iter().any(|paper| is_on_sheet(paper, pos_world));
        if is_usable {
            let reflectance = desk.phantoms[k].reflectance;
            points.push(MeterPoint { pos_world, normal_world, surface: Surface::Phantom(k), reflectance });
        }
    }
    let step = points.len().div_ceil(MOST_POINTS).max(1);
    points.into_iter().step_by(step).collect()
}

fn is_on_sheet(paper: &Paper, pos_world: Vec3) -> bool {
    let pos = paper.world_from_marker.inverse().transform_point3(pos_world);
    pos.y.abs() < 0.01 && pos.x.abs().max(pos.z.abs()) < (0.5 + SHEET_MARGIN) * paper.size
}

/// Half width of the square of pixels that one brightness is taken from.
const WINDOW: i32 = 3;
/// Quarters of the square that differ by more show an edge: share of the mean, and linear camera units.
const MOST_CONTRAST: (f32, f32) = (0.08, 0.01);

/// Radiance of the picture about a pixel: per channel the mean of the middle half, NaN where it is clipped. `None` across edges and
/// outside of the picture.
pub(super) fn brightness(frame: &FramePixels, pixel: Vec2) -> Option<Vec3> {
    let (x, y) = (pixel.x as i32, pixel.y as i32);
    let size = frame.size.as_ivec2();
    if x < WINDOW || y < WINDOW || x + WINDOW >= size.x || y + WINDOW >= size.y {
        return None;
    }
    let mut values: [Vec<f32>; 3] = Default::default();
    let mut quarters = [(0.0_f32, 0.0_f32); 4];
    for dy in -WINDOW..=WINDOW {
        for dx in -WINDOW..=WINDOW {
            let value = frame.linear(x + dx, y + dy);
            for (channel, value) in values.iter_mut().zip(value.to_array()) {
                channel.push(value);
            }
            if dx != 0 && dy != 0 {
                let quarter = &mut quarters[usize::from(dx > 0) + 2 * usize::from(dy > 0)];
                // Fireflies and dust must not look like an edge.
                quarter.0 += value.element_sum().min(3.0).sqrt();
                quarter.1 += 1.0;
            }
        }
    }
    let means = quarters.map(|(sum, count)| (sum / count).powi(2) / 3.0);
    let (low, high) = means.into_iter().fold((f32::MAX, 0.0_f32), |(low, high), m| (low.min(m), high.max(m)));
    if high - low > MOST_CONTRAST.0 * high + MOST_CONTRAST.1 {
        return None;
    }
    Some(Vec3::from_array(values.map(|mut channel| {
        channel.sort_by(f32::total_cmp);
        let (from, to) = (channel.len() / 4, channel.len() - channel.len() / 4);
        let mean = channel[from..to].iter().sum::<f32>() / (to - from) as f32;
        if channel[to - 1] > CLIPPED_ABOVE { f32::NAN } else { mean }
    })))
}

/// A surface this bright may be clipped in part, linear camera units.
const CLIPPED_ABOVE: f32 = 0.97;
