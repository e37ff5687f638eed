//! How far away the lamps are: shadows and fall-off on the desk that a light from far away does not explain.
//!
//! A lamp two metres away lights the near edge of a desk by a third more than the far edge, and its shadows fan out. Solved as light
//! from far away, that is explained by lights that are not there. So the strongest compact regions are tried at a few distances; one
//! is kept where the whole desk is explained clearly better.

use super::{
    desk_picture::{DeskPicture, MirrorBall},
    equations::{GRAY, Problem, with_gray},
    gains::GraySolution,
    meter::{Desk, NearLight, Surface},
};
use bevy::prelude::*;

/// Inverse distances that are tried, per metre; the first is far away.
const TRIED: [f32; 6] = [0.0, 0.2, 0.35, 0.6, 1.0, 1.8];
/// A desk that is explained this well needs no more.
const GOOD: f64 = 0.04;
/// A place is taken if it lowers the cost of the desk to this share.
const BETTER: f64 = 0.85;
/// Regions with less of the paper's light are not tried.
const LEAST_SHARE: f64 = 0.1;
/// Points beside the paper's below which nothing is told of places.
const LEAST_POINTS: usize = 100;
/// Wider regions (root mean square, radians) are windows.
const WIDEST: f32 = 0.2;
/// Most regions that are placed, strongest first.
const MOST: usize = 3;

/// Per point, what a unit of extra gain adds: light that may grow without and up to its limit.
type Shares = Vec<([f64; 4], [f64; 4])>;

/// Where lights were found to be in the picture before.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownPlaces {
    /// Directions and inverse distances.
    places: Vec<(Vec3, f32)>,
    /// How well they explained the desk.
    cost: Option<f64>,
}

/// A desk that is explained at most this many times worse than in the picture before needs no new search.
const STILL_GOOD: f64 = 1.4;
/// How far the distance is varied from picture to picture, share of its inverse.
const STEP: f32 = 0.1;
/// Lights move by less from picture to picture, radians.
const SAME: f32 = 0.2;

/// What the balls and the camera have to do with places.
struct Setting<'a> {
    desk: Desk<'a>,
    ball: MirrorBall,
    to_camera: Vec3,
}

impl<'a> Setting<'a> {
    /// Where a light is mirrored to the camera.
    fn origin(&self, dir: Vec3) -> Vec3 {
        self.ball.center + self.ball.radius * (dir + self.to_camera).normalize_or(dir)
    }

    fn light(&self, dir: Vec3, inverse: f32) -> NearLight<'a> {
        NearLight { desk: self.desk, origin: self.origin(dir), distance: 1.0 / inverse }
    }
}

impl Problem<'_> {
    /// Places the strongest lights where the desk says they are, and solves anew.
    pub(super) fn place_near_lights(
        &mut self,
        picture: &DeskPicture,
        known: &mut KnownPlaces,
        far: GraySolution,
    ) -> GraySolution {
        let paper_points = self.equations.iter().filter(|e| e.point.surface == Surface::Paper).count();
        if self.equations.len() < paper_points + LEAST_POINTS {
            return far;
        }
        let balls = picture.balls();
        let eye = Vec3::from(picture.camera_from_world.inverse().translation);
        let setting = Setting {
            desk: Desk { balls: &balls, papers: &picture.papers, phantoms: &picture.phantoms },
            ball: picture.ball,
            to_camera: (eye - picture.ball.center).normalize_or_zero(),
        };
        let mut gray = far;
        let mut inverses = vec![0.0; self.regions.len()];
        let all_far: Vec<Shares> = (0..self.regions.len()).map(|r| self.shares_of(r)).collect();
        for &(dir, inverse) in &known.places {
            let angle = |r: &usize| self.regions[*r].dir_world.angle_between(dir);
            let nearest = (0..self.regions.len()).min_by(|a, b| angle(a).total_cmp(&angle(b)));
            if let Some(region) = nearest.filter(|r| angle(r) < SAME) {
                let shares = self.shares_at(region, setting.light(self.regions[region].dir_world, inverse));
                self.set_shares(region, &shares);
                inverses[region] = inverse;
            }
        }
        if !known.places.is_empty() {
            gray = self.better_start(&gray.x);
            // It may come nearer or go away.
            for (region, inverse) in inverses.iter_mut().enumerate().filter(|(_, inverse)| **inverse > 0.0) {
                let (start, dir) = (*inverse, self.regions[region].dir_world);
                let light = |inverse| setting.light(dir, inverse);
                *inverse = self.refine(region, (start, STEP * start), 1, &mut gray, light);
            }
        }
        if known.cost.is_none_or(|cost| gray.cost > STILL_GOOD * cost) {
            for (region, shares) in all_far.iter().enumerate() {
                self.set_shares(region, shares);
            }
            inverses.fill(0.0);
            gray = self.better_start(&gray.x);
            gray = self.search_places(&setting, gray, &mut inverses);
            known.cost = Some(gray.cost);
        }
        let lights = self.regions.iter().zip(&inverses).filter(|(_, inverse)| **inverse > 0.0);
        known.places = lights.map(|(region, inverse)| (region.dir_world, *inverse)).collect();
        for ((position, inverse), region) in self.positions.iter_mut().zip(&inverses).zip(self.regions) {
            *position = (*inverse > 0.0).then(|| setting.origin(region.dir_world) + region.dir_world / *inverse);
        }
        gray
    }

    fn better_start(&mut self, x: &[f64]) -> GraySolution {
        let cold = self.solve_gray(None);
        let warm = self.solve_gray(Some(x));
        // The last one's albedos are those that count from here on.
        if warm.cost <= cold.cost { warm } else { self.solve_gray(Some(&cold.x)) }
    }

    fn search_places(&mut self, setting: &Setting, mut gray: GraySolution, inverses: &mut [f32]) -> GraySolution {
        let mut done: Vec<usize> = Vec::new();
        while done.len() < MOST && gray.cost > GOOD {
            let Some(region) = self.strongest_compact(&gray, &done) else {
                break;
            };
            done.push(region);
            let dir = self.regions[region].dir_world;
            let far = self.shares_of(region);
            let mut best: Option<(usize, Shares, GraySolution)> = None;
            for (k, inverse) in TRIED.into_iter().enumerate().skip(1) {
                let shares = self.shares_at(region, setting.light(dir, inverse));
                self.set_shares(region, &shares);
                let solution = self.better_start(&gray.x);
                if best.as_ref().is_none_or(|(.., best)| solution.cost < best.cost) {
                    best = Some((k, shares, solution));
                }
            }
            match best.filter(|(.., solution)| solution.cost < BETTER * gray.cost) {
                Some((k, shares, solution)) => {
                    self.set_shares(region, &shares);
                    // Albedos belong to the solution too.
                    gray = self.solve_gray(Some(&solution.x));
                    let next = TRIED.get(k + 1).map_or(f32::MAX, |next| next - TRIED[k]);
                    let step = 0.5 * next.min(TRIED[k] - TRIED[k - 1]);
                    let light = |inverse| setting.light(dir, inverse);
                    inverses[region] = self.refine(region, (TRIED[k], step), 3, &mut gray, light);
                }
                None => self.set_shares(region, &far),
            }
        }
        let x = gray.x.clone();
        let last = self.solve_gray(Some(&x));
        if last.cost <= gray.cost { last } else { gray }
    }

    /// The inverse distance about one at which the desk is explained best: both sides, then half of the step. Leaves the region there.
    fn refine<'d>(
        &mut self,
        region: usize,
        (start, mut step): (f32, f32),
        rounds: usize,
        gray: &mut GraySolution,
        light: impl Fn(f32) -> NearLight<'d>,
    ) -> f32 {
        let mut best = (start, self.shares_of(region));
        for _ in 0..rounds {
            let middle = best.0;
            for inverse in [middle - step, middle + step] {
                let shares = self.shares_at(region, light(inverse));
                self.set_shares(region, &shares);
                let solution = self.solve_gray(Some(&gray.x));
                if solution.cost < gray.cost {
                    best = (inverse, shares);
                    *gray = solution;
                }
            }
            step *= 0.5;
        }
        self.set_shares(region, &best.1);
        best.0
    }

    fn strongest_compact(&self, gray: &GraySolution, done: &[usize]) -> Option<usize> {
        let total = self.open_irradiance(GRAY, &gray.x);
        let share = |r: usize| gray.x[r] * self.mean_per_gain(r) / total;
        let is_candidate =
            |r: &usize| !done.contains(r) && self.regions[*r].spread < WIDEST && share(*r) >= LEAST_SHARE;
        (0..self.regions.len()).filter(is_candidate).max_by(|&a, &b| share(a).total_cmp(&share(b)))
    }

    fn shares_at(&self, region: usize, light: NearLight) -> Shares {
        let cells = &self.regions[region].cells;
        let shares = self.equations.iter().map(|equation| {
            let (mut free, mut limited) = (Vec3::ZERO, Vec3::ZERO);
            let mirrored = &self.meter.mirrored[equation.meter_index];
            let weights = light.weights(&equation.point, mirrored, cells.iter().map(|&i| self.sky[i]));
            for ((&i, share), weight) in cells.iter().zip(&self.profiles[region]).zip(weights) {
                free += weight * share * self.sky[i].clipped;
                limited += weight * share * self.sky[i].limited;
            }
            (with_gray(free), with_gray(limited))
        });
        shares.collect()
    }

    fn shares_of(&self, region: usize) -> Shares {
        self.equations.iter().map(|e| (e.per_gain[region], e.limited[region])).collect()
    }

    fn set_shares(&mut self, region: usize, shares: &Shares) {
        for (equation, (free, limited)) in self.equations.iter_mut().zip(shares) {
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
