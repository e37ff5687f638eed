//! Darker views of clipped regions: a dark ball beside the bright one, which acts as a shorter exposure in the same
//! frame (Karlsson & Selegård 2005), or a frame with a shorter exposure (Debevec & Malik 1997).

use super::{
    camera_match::compare_papers,
    desk_frame::{DeskFrame, MirrorBall},
    radiance_cells::{BallInFrame, CELLS_PER_EDGE, RadianceCell},
    ray_cast::sphere_is_hit,
    regions::{Region, neighbors_of},
};
use crate::{
    camera::PosedFrame,
    probe::{BallView, EDGE_MARGIN_PIXELS},
};
use bevy::{math::DVec3, prelude::*};

/// Light of a clipped region as a darker view shows it: radiance · steradian per channel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BracketReading {
    pub region: usize,
    /// Light of the region in the darker view.
    pub energy: DVec3,
    /// Whether the reading is a lower bound, per channel: the darker view clips too or shows only a part of the region.
    pub is_bound: [bool; 3],
    /// Extra radiance of each cell of the region, if both views show the light in the same place. It is then distant.
    pub shape: Option<Vec<f32>>,
    /// Fraction of the light that is clipped in the darker view, in the channel with the most.
    clipped_fraction: f32,
    /// Pixel value in the darker view per unit of radiance.
    sensitivity: f32,
}

/// Largest sensitivity of another ball, relative to the first ball, at which it is used as a darker view.
const MAX_DARK_BALL_SENSITIVITY: f32 = 0.5;
/// Largest angle by which a lamp moves from ball to ball, radians. Reached by lamps at half a meter.
const MAX_PARALLAX: f32 = 0.3;
/// Largest clipped fraction of the light at which a reading is not a lower bound.
const MAX_CLIPPED_FRACTION: f32 = 0.02;
/// Smallest fraction of a region's solid angle that the darker view has to show. Below it, the reading is a lower
/// bound.
const MIN_COVERAGE: f32 = 0.8;
/// Smallest fraction of a distant light that both views show in the same place.
const MIN_IN_PLACE_FRACTION: f32 = 0.7;
/// Pixels darker than this, linear camera units (sRGB 16), are more noise than light.
const MIN_RADIANCE: f32 = 0.005;
/// Largest factor between the brightness of the paper and the stated exposure. Beyond it, the bracketed frame is
/// ignored, because it shows other light.
const MAX_MISMATCH: f32 = 1.25;
/// Paper darker than this in a bracketed frame, linear camera units (sRGB 10), does not reveal its exposure.
const MIN_PAPER_RADIANCE: f32 = 0.003;

/// Reads the clipped regions in all darker views.
pub(super) fn read_bracketed_views(desk: &DeskFrame, sky: &[RadianceCell], regions: &[Region]) -> Vec<BracketReading> {
    let balls = desk.balls();
    let frames = std::iter::once(desk.posed_frame())
        .chain(desk.posed_bracketed_frames().filter(|posed| is_same_light(desk, posed)));
    let views = frames.flat_map(|posed| {
        balls.iter().enumerate().map(move |(i, ball)| BracketedView { posed, ball, is_first: i == 0 })
    });
    let readings = views.filter(|view| view.is_darker(desk)).flat_map(|view| view.read(desk, sky, regions));
    best(readings.collect())
}

/// For each region, keeps the reading with the smallest clipped fraction of those that are not lower bounds; ties go to
/// the most sensitive view, which has the least noise. Lower bounds are all kept.
fn best(readings: Vec<BracketReading>) -> Vec<BracketReading> {
    let is_whole = |reading: &BracketReading| reading.is_bound == [false; 3];
    let is_better = |a: &BracketReading, b: &BracketReading| {
        let by_clipping = a.clipped_fraction.total_cmp(&b.clipped_fraction);
        by_clipping.then(b.sensitivity.total_cmp(&a.sensitivity)).is_lt()
    };
    let is_beaten = |reading: &BracketReading| {
        readings.iter().any(|other| other.region == reading.region && is_whole(other) && is_better(other, reading))
    };
    readings.iter().filter(|reading| !is_whole(reading) || !is_beaten(reading)).cloned().collect()
}

/// Whether the paper confirms the stated exposure and unchanged light. `true` without visible paper.
fn is_same_light(desk: &DeskFrame, posed: &PosedFrame) -> bool {
    let Some(paper) = compare_papers((desk.posed_frame(), &desk.papers), (*posed, &desk.papers), MIN_PAPER_RADIANCE)
    else {
        return true;
    };
    let mismatch = paper.gain * posed.exposure;
    let is_same_light = mismatch.max_element() <= MAX_MISMATCH && mismatch.min_element() >= 1.0 / MAX_MISMATCH;
    if !is_same_light {
        debug!("a shorter exposure of {} is ignored: its paper is {mismatch} times too dark", posed.exposure);
    }
    is_same_light
}

/// Region nearest to a direction, if parallax between the balls may move a lamp of that region there.
fn nearest_region(dir_world: Vec3, sky: &[RadianceCell], regions: &[Region]) -> Option<usize> {
    let distance = |region: &Region| {
        let nearest = region.cells.iter().map(|&i| sky[i].dir_world.distance_squared(dir_world));
        nearest.fold(f32::INFINITY, f32::min)
    };
    let nearest = regions.iter().enumerate().map(|(r, region)| (r, distance(region)));
    let nearest = nearest.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, d)| *d < MAX_PARALLAX * MAX_PARALLAX);
    nearest.map(|(r, _)| r)
}

/// For each cell, the region that contains or touches it, and the cell's radiance without the region's gain. The rim of
/// a lamp belongs to the lamp, however dim it is.
fn in_place(sky: &[RadianceCell], regions: &[Region]) -> Vec<Option<(usize, Vec3)>> {
    let mut cells = vec![None; sky.len()];
    for (r, region) in regions.iter().enumerate() {
        for &i in &region.cells {
            cells[i] = Some((r, sky[i].seen - sky[i].clipped - sky[i].limited));
        }
    }
    for (r, region) in regions.iter().enumerate() {
        for &i in region.cells.iter().flat_map(|&i| neighbors_of(i)) {
            cells[i].get_or_insert((r, sky[i].seen));
        }
    }
    cells
}

/// A ball in a frame.
struct BracketedView<'a> {
    posed: PosedFrame<'a>,
    ball: &'a MirrorBall,
    /// Whether it is the ball that shows the sky.
    is_first: bool,
}

impl BracketedView<'_> {
    fn sensitivity(&self) -> f32 {
        self.posed.exposure * self.ball.reflectance
    }

    fn is_darker(&self, desk: &DeskFrame) -> bool {
        // A shorter exposure of the same ball is useful even if it is only slightly shorter.
        let max_sensitivity = if self.is_first { 1.0 } else { MAX_DARK_BALL_SENSITIVITY };
        self.sensitivity() < max_sensitivity * desk.ball.reflectance
    }

    fn read(&self, desk: &DeskFrame, sky: &[RadianceCell], regions: &[Region]) -> Vec<BracketReading> {
        let Self { posed, ball, .. } = self;
        let Some(view) = BallView::new(posed.camera_from_world.transform_point3(ball.center), ball.radius) else {
            return Vec::new();
        };
        let dark = BallInFrame::new(*posed, ball, &view).radiance_cells(CELLS_PER_EDGE);
        let is_shown = self.shown(desk, &view);
        let in_place = if self.is_first { in_place(sky, regions) } else { vec![None; sky.len()] };
        // Cells brighter than white in the darker view are those that the bright view clips. Near lamps are displaced
        // in it.
        let white = (1.0 / desk.ball.reflectance).max(MIN_RADIANCE / self.sensitivity());
        let mut sums = vec![(Vec3::ZERO, Vec3::ZERO); regions.len()];
        for (cell, in_place) in dark.iter().zip(in_place).filter(|(cell, _)| is_shown(cell.dir_world)) {
            let is_bright = cell.seen.max_element() >= white;
            let moved = || nearest_region(cell.dir_world, sky, regions).filter(|_| is_bright).map(|r| (r, Vec3::ZERO));
            if let Some((r, known)) = in_place.or_else(moved) {
                sums[r].0 += cell.solid_angle * (cell.seen - known);
                sums[r].1 += cell.solid_angle * (cell.clipped + cell.limited);
            }
        }
        let is_covered = |region: &Region| {
            let shown = region.cells.iter().map(|&i| &sky[i]).filter(|cell| is_shown(cell.dir_world));
            shown.map(|cell| cell.solid_angle).sum::<f32>() >= MIN_COVERAGE * region.solid_angle
        };
        let readings = sums.into_iter().zip(regions).enumerate().filter_map(|(region, ((energy, clipped), cells))| {
            let clipped_fraction = |c: usize| if energy[c] > 0.0 { clipped[c] / energy[c] } else { 0.0 };
            let is_bound = |c| clipped_fraction(c) > MAX_CLIPPED_FRACTION || !is_covered(cells);
            let extra = |&i: &usize| (dark[i].seen - sky[i].seen).element_sum().max(0.0);
            let energy = energy.max(Vec3::ZERO);
            let in_place: f32 = cells.cells.iter().map(|&i| sky[i].solid_angle * dark[i].seen.element_sum()).sum();
            let is_in_place = in_place >= MIN_IN_PLACE_FRACTION * energy.element_sum() && is_covered(cells);
            let shape: Vec<f32> = cells.cells.iter().map(extra).collect();
            let has_shape = is_in_place && shape.iter().any(|extra| *extra > 0.0);
            let white: Vec3 = cells.cells.iter().map(|&i| sky[i].solid_angle * (sky[i].clipped + sky[i].limited)).sum();
            // The same ball cannot show a region darker than is already known, unless the light has changed: for
            // example, a lamp that has just been switched on.
            let is_other = self.is_first && energy.element_sum() < MIN_IN_PLACE_FRACTION * white.element_sum();
            (!is_other).then(|| BracketReading {
                region,
                energy: energy.as_dvec3(),
                is_bound: std::array::from_fn(is_bound),
                shape: has_shape.then_some(shape),
                clipped_fraction: (0..3).map(clipped_fraction).fold(0.0, f32::max),
                sensitivity: self.sensitivity(),
            })
        });
        readings.collect()
    }

    /// Whether the ball shows a direction to the camera, inside its rim and past the other balls.
    fn shown(&self, desk: &DeskFrame, view: &BallView) -> impl Fn(Vec3) -> bool {
        let ball = *self.ball;
        let edge_angle = view.edge_angle(&self.posed.intrinsics, EDGE_MARGIN_PIXELS);
        let eye: Vec3 = self.posed.camera_from_world.inverse().translation.into();
        let to_camera = (eye - ball.center).normalize_or_zero();
        let others: Vec<MirrorBall> = desk.balls().into_iter().filter(|other| other.center != ball.center).collect();
        move |dir| {
            let is_hidden = |other: &MirrorBall| {
                let from_surface = other.center - ball.center - ball.radius * (dir + to_camera).normalize_or_zero();
                sphere_is_hit(from_surface, other.radius, dir) || sphere_is_hit(from_surface, other.radius, to_camera)
            };
            dir.angle_between(to_camera) < edge_angle && !others.iter().any(is_hidden)
        }
    }
}
