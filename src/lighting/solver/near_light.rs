//! Distance of near lamps, from shadows and fall-off on the desk that distant light does not explain.
//!
//! A lamp two meters away lights the near edge of a desk by a third more than the far edge, and its shadows fan out.
//! Solved as distant light, that leads to lights that do not exist. The solver therefore tries a few distances for the
//! strongest compact regions, and keeps one if it explains the whole desk clearly better.

use super::{
    desk_frame::{DeskFrame, DeskGeometry, MirrorBall},
    equations::{GRAY, Problem, with_gray},
    light_transport::NearLight,
    robust_fit::GrayFit,
    sample_points::Surface,
};
use glam::Vec3;

/// Inverse distances to try, per meter; the first is infinitely far away.
const INVERSE_DISTANCES: [f32; 6] = [0.0, 0.2, 0.35, 0.6, 1.0, 1.8];
/// Cost of a desk below which no distances are searched.
const MAX_GOOD_COST: f64 = 0.04;
/// Largest cost of the desk, relative to that without the light's distance, at which the distance is accepted.
const MAX_COST_RATIO: f64 = 0.85;
/// Smallest fraction of the paper's light at which a region is tried.
const MIN_PAPER_FRACTION: f64 = 0.1;
/// Fewest points on phantoms for which distances are estimated.
const MIN_PHANTOM_POINTS: usize = 100;
/// Root mean square radius from which on regions count as windows, radians.
const MAX_RMS_RADIUS: f32 = 0.2;
/// Largest number of near lights, strongest first.
const MAX_NEAR_LIGHTS: usize = 3;

/// Irradiance of each point per unit of extra gain: of light with unlimited and with limited gain.
type GainResponses = Vec<([f64; 4], [f64; 4])>;

/// Distances of near lights in the previous frame.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownDistances {
    /// Directions and inverse distances.
    lights: Vec<(Vec3, f32)>,
    /// Cost of the desk when distances were last searched.
    cost: Option<f64>,
}

/// Largest ratio of a desk's cost to that of the last search. Beyond it, distances are searched again.
const MAX_COST_GROWTH: f64 = 1.4;
/// Relative step by which an inverse distance is refined from frame to frame.
const RELATIVE_STEP: f32 = 0.1;
/// Largest angle by which a light moves from frame to frame, radians.
const MAX_LIGHT_MOTION: f32 = 0.2;

/// Position of the ball and the camera, which determine where lights are mirrored.
struct BallGeometry<'a> {
    desk: DeskGeometry<'a>,
    ball: MirrorBall,
    to_camera: Vec3,
}

impl<'a> BallGeometry<'a> {
    /// Point of the ball where a light is mirrored to the camera.
    fn origin(&self, dir: Vec3) -> Vec3 {
        self.ball.center + self.ball.radius * (dir + self.to_camera).normalize_or(dir)
    }

    fn light(&self, dir: Vec3, inverse: f32) -> NearLight<'a> {
        NearLight { geometry: self.desk, origin: self.origin(dir), distance: 1.0 / inverse }
    }
}

impl Problem<'_> {
    /// Estimates the distances of the strongest lights and solves again.
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
            let wide = (0..self.regions.len()).filter(|r| Some(*r) != self.small_region());
            let nearest = wide.min_by(|a, b| angle(a).total_cmp(&angle(b)));
            if let Some(region) = nearest.filter(|r| angle(r) < MAX_LIGHT_MOTION) {
                let responses = self.responses_at(region, geometry.light(self.regions[region].dir_world, inverse));
                self.set_responses(region, &responses);
                inverses[region] = inverse;
            }
        }
        if !known.lights.is_empty() {
            gray = self.fit_from_best_start(&gray.x);
            // The lamp may come nearer or go away.
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
        // The albedo classes stored in the problem are those of the last fit, so the better fit has to come last.
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
                    // The albedo classes belong to the solution too.
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

    /// Refines an inverse distance: tries both sides, then half of the step. Leaves the region at the best one.
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
            !done.contains(r)
                && Some(*r) != self.small_region()
                && self.regions[*r].rms_radius < MAX_RMS_RADIUS
                && fraction(*r) >= MIN_PAPER_FRACTION
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

    /// Mean irradiance of the paper per unit of extra gain.
    pub(super) fn mean_per_gain(&self, region: usize) -> f64 {
        let papers = self.equations.iter().filter(|e| e.point.surface == Surface::Paper);
        let (sum, count) = papers.fold((0.0, 0.0), |(s, n), e| (s + e.per_gain[region][GRAY], n + 1.0));
        sum / f64::max(count, 1.0)
    }
}
