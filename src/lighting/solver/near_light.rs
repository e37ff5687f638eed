//! How far away the lamps are: shadows and fall-off on the desk that a light from far away does not explain.
//!
//! A lamp two metres away lights the near edge of a desk by a third more than the far edge, and its shadows fan out. Solved as light
//! from far away, that is explained by lights that are not there. So the strongest compact regions are tried at a few distances; one
//! is kept where the whole desk is explained clearly better.

use super::{
    desk_frame::{DeskFrame, DeskGeometry, MirrorBall},
    equations::{GRAY, Problem, with_gray},
    light_transport::NearLight,
    robust_fit::GrayFit,
    sample_points::Surface,
};
use bevy::prelude::*;

/// Inverse distances that are tried, per metre; the first is far away.
const INVERSE_DISTANCES: [f32; 6] = [0.0, 0.2, 0.35, 0.6, 1.0, 1.8];
/// A desk that is explained this well needs no more.
const MAX_GOOD_COST: f64 = 0.04;
/// A place is taken if it lowers the cost of the desk to this share.
const MAX_COST_RATIO: f64 = 0.85;
/// Regions with less of the paper's light are not tried.
const MIN_PAPER_FRACTION: f64 = 0.1;
/// Points beside the paper's below which nothing is told of places.
const MIN_PHANTOM_POINTS: usize = 100;
/// Wider regions (root mean square, radians) are windows.
const MAX_RMS_RADIUS: f32 = 0.2;
/// Most regions that are placed, strongest first.
const MAX_NEAR_LIGHTS: usize = 3;

/// Per point, what a unit of extra gain adds: light that may grow without and up to its limit.
type GainResponses = Vec<([f64; 4], [f64; 4])>;

/// Where lights were found to be in the picture before.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownDistances {
    /// Directions and inverse distances.
    lights: Vec<(Vec3, f32)>,
    /// How well they explained the desk.
    cost: Option<f64>,
}

/// A desk that is explained at most this many times worse than in the picture before needs no new search.
const MAX_COST_GROWTH: f64 = 1.4;
/// How far the distance is varied from picture to picture, share of its inverse.
const RELATIVE_STEP: f32 = 0.1;
/// Lights move by less from picture to picture, radians.
const MAX_LIGHT_MOTION: f32 = 0.2;

/// What the balls and the camera have to do with places.
struct BallGeometry<'a> {
    desk: DeskGeometry<'a>,
    ball: MirrorBall,
    to_camera: Vec3,
}

impl<'a> BallGeometry<'a> {
    /// Where a light is mirrored to the camera.
    fn origin(&self, dir: Vec3) -> Vec3 {
        self.ball.center + self.ball.radius * (dir + self.to_camera).normalize_or(dir)
    }

    fn light(&self, dir: Vec3, inverse: f32) -> NearLight<'a> {
        NearLight { geometry: self.desk, origin: self.origin(dir), distance: 1.0 / inverse }
    }
}

impl Problem<'_> {
    /// Places the strongest lights where the desk says they are, and solves anew.
    pub(super) fn locate_near_lights(&mut self, desk: &DeskFrame, known: &mut KnownDistances, far: GrayFit) -> GrayFit {
        let paper_points = self.equations.iter().filter(|e| e.point.surface == Surface::Paper).count();
        if self.equations.len() < paper_points + MIN_PHANTOM_POINTS {
            return far;
        }
        let balls = desk.balls();
        let eye = Vec3::from(desk.camera_from_world.inverse().translation);
        let geometry = BallGeometry {
            desk: DeskGeometry { balls: &balls, papers: &desk.papers, phantoms: &desk.phantoms },
            ball: desk.ball,
            to_camera: (eye - desk.ball.center).normalize_or_zero(),
        };
        let mut gray = far;
        let mut inverses = vec![0.0; self.regions.len()];
        let all_far: Vec<GainResponses> = (0..self.regions.len()).map(|r| self.responses_of(r)).collect();
        for &(dir, inverse) in &known.lights {
            let angle = |r: &usize| self.regions[*r].dir_world.angle_between(dir);
            let nearest = (0..self.regions.len()).min_by(|a, b| angle(a).total_cmp(&angle(b)));
            if let Some(region) = nearest.filter(|r| angle(r) < MAX_LIGHT_MOTION) {
                let responses = self.responses_at(region, geometry.light(self.regions[region].dir_world, inverse));
                self.set_responses(region, &responses);
                inverses[region] = inverse;
            }
        }
        if !known.lights.is_empty() {
            gray = self.fit_from_best_start(&gray.x);
            // It may come nearer or go away.
            for (region, inverse) in inverses.iter_mut().enumerate().filter(|(_, inverse)| **inverse > 0.0) {
                let (start, dir) = (*inverse, self.regions[region].dir_world);
                let light = |inverse| geometry.light(dir, inverse);
                *inverse = self.refine(region, (start, RELATIVE_STEP * start), 1, &mut gray, light);
            }
        }
        if known.cost.is_none_or(|cost| gray.cost > MAX_COST_GROWTH * cost) {
            for (region, responses) in all_far.iter().enumerate() {
                self.set_responses(region, responses);
            }
            inverses.fill(0.0);
            gray = self.fit_from_best_start(&gray.x);
            gray = self.search_distances(&geometry, gray, &mut inverses);
            known.cost = Some(gray.cost);
        }
        let lights = self.regions.iter().zip(&inverses).filter(|(_, inverse)| **inverse > 0.0);
        known.lights = lights.map(|(region, inverse)| (region.dir_world, *inverse)).collect();
        for ((position, inverse), region) in self.positions.iter_mut().zip(&inverses).zip(self.regions) {
            *position = (*inverse > 0.0).then(|| geometry.origin(region.dir_world) + region.dir_world / *inverse);
        }
        gray
    }

    fn fit_from_best_start(&mut self, x: &[f64]) -> GrayFit {
        let cold = self.fit_gray(None);
        let warm = self.fit_gray(Some(x));
        // The last one's albedos are those that count from here on.
        if warm.cost <= cold.cost { warm } else { self.fit_gray(Some(&cold.x)) }
    }

    fn search_distances(&mut self, geometry: &BallGeometry, mut gray: GrayFit, inverses: &mut [f32]) -> GrayFit {
        let mut done: Vec<usize> = Vec::new();
        while done.len() < MAX_NEAR_LIGHTS && gray.cost > MAX_GOOD_COST {
            let Some(region) = self.strongest_compact(&gray, &done) else {
                break;
            };
            done.push(region);
            let dir = self.regions[region].dir_world;
            let far = self.responses_of(region);
            let mut best: Option<(usize, GainResponses, GrayFit)> = None;
            for (k, inverse) in INVERSE_DISTANCES.into_iter().enumerate().skip(1) {
                let responses = self.responses_at(region, geometry.light(dir, inverse));
                self.set_responses(region, &responses);
                let solution = self.fit_from_best_start(&gray.x);
                if best.as_ref().is_none_or(|(.., best)| solution.cost < best.cost) {
                    best = Some((k, responses, solution));
                }
            }
            match best.filter(|(.., solution)| solution.cost < MAX_COST_RATIO * gray.cost) {
                Some((k, responses, solution)) => {
                    self.set_responses(region, &responses);
                    // Albedos belong to the solution too.
                    gray = self.fit_gray(Some(&solution.x));
                    let next = INVERSE_DISTANCES.get(k + 1).map_or(f32::MAX, |next| next - INVERSE_DISTANCES[k]);
                    let step = 0.5 * next.min(INVERSE_DISTANCES[k] - INVERSE_DISTANCES[k - 1]);
                    let light = |inverse| geometry.light(dir, inverse);
                    inverses[region] = self.refine(region, (INVERSE_DISTANCES[k], step), 3, &mut gray, light);
                }
                None => self.set_responses(region, &far),
            }
        }
        let x = gray.x.clone();
        let last = self.fit_gray(Some(&x));
        if last.cost <= gray.cost { last } else { gray }
    }

    /// The inverse distance about one at which the desk is explained best: both sides, then half of the step. Leaves the region there.
    fn refine<'d>(
        &mut self,
        region: usize,
        (start, mut step): (f32, f32),
        rounds: usize,
        gray: &mut GrayFit,
        light: impl Fn(f32) -> NearLight<'d>,
    ) -> f32 {
        let mut best = (start, self.responses_of(region));
        for _ in 0..rounds {
            let middle = best.0;
            for inverse in [middle - step, middle + step] {
                let responses = self.responses_at(region, light(inverse));
                self.set_responses(region, &responses);
                let solution = self.fit_gray(Some(&gray.x));
                if solution.cost < gray.cost {
                    best = (inverse, responses);
                    *gray = solution;
                }
            }
            step *= 0.5;
        }
        self.set_responses(region, &best.1);
        best.0
    }

    fn strongest_compact(&self, gray: &GrayFit, done: &[usize]) -> Option<usize> {
        let total = self.open_irradiance(GRAY, &gray.x);
        let fraction = |r: usize| gray.x[r] * self.mean_per_gain(r) / total;
        let is_candidate = |r: &usize| {
            !done.contains(r) && self.regions[*r].rms_radius < MAX_RMS_RADIUS && fraction(*r) >= MIN_PAPER_FRACTION
        };
        (0..self.regions.len()).filter(is_candidate).max_by(|&a, &b| fraction(a).total_cmp(&fraction(b)))
    }

    fn responses_at(&self, region: usize, light: NearLight) -> GainResponses {
        let cells = &self.regions[region].cells;
        let responses = self.equations.iter().map(|equation| {
            let (mut free, mut limited) = (Vec3::ZERO, Vec3::ZERO);
            let reflections = &self.transport.reflections[equation.point_index];
            let weights = light.weights(&equation.point, reflections, cells.iter().map(|&i| self.sky[i]));
            for ((&i, profile), weight) in cells.iter().zip(&self.profiles[region]).zip(weights) {
                free += weight * profile * self.sky[i].clipped;
                limited += weight * profile * self.sky[i].limited;
            }
            (with_gray(free), with_gray(limited))
        });
        responses.collect()
    }

    fn responses_of(&self, region: usize) -> GainResponses {
        self.equations.iter().map(|e| (e.per_gain[region], e.limited[region])).collect()
    }

    fn set_responses(&mut self, region: usize, responses: &GainResponses) {
        for (equation, (free, limited)) in self.equations.iter_mut().zip(responses) {
            (equation.per_gain[region], equation.limited[region]) = (*free, *limited);
        }
    }

    /// What one unit of extra gain adds to the paper.
    fn mean_per_gain(&self, region: usize) -> f64 {
        let papers = self.equations.iter().filter(|e| e.point.surface == Surface::Paper);
        let (sum, count) = papers.fold((0.0, 0.0), |(s, n), e| (s + e.per_gain[region][GRAY], n + 1.0));
        sum / f64::max(count, 1.0)
    }
}
