//! Camera picture + what stands on the desk → how bright the clipped lights are.

use super::{
    dark_ball::{DarkReading, read_dark_balls},
    find::{FoundLight, find_lights},
    least_squares::NormalEquations,
    meter::{Desk, Meter, MeterPoint, MirrorBall, Paper, Surface, brightness},
    near_light::KnownPlaces,
    ray_cast::PhantomSolid,
    regions::{Region, clipped_regions, profiles, shaped},
    sky::{BallPicture, SKY_EDGE, SkyCell},
    triangulate::triangulate,
};
use crate::{
    camera::{FramePixels, Intrinsics},
    probe::BallView,
};
use bevy::{math::Affine3A, prelude::*};
use std::{f32::consts::PI, sync::Arc};

/// Everything that is known of a desk when a picture of it has been taken.
#[derive(Clone, Debug)]
pub struct DeskPicture {
    /// The picture.
    pub frame: Arc<FramePixels>,
    /// The camera's, for pictures of this size.
    pub intrinsics: Intrinsics,
    /// World → camera (Bevy axes), rigid.
    pub camera_from_world: Affine3A,
    /// The mirrored ball.
    pub ball: MirrorBall,
    /// Other mirrored balls. Darker ones tell how bright the lamps are that the first one shows clipped; two balls tell where lamps
    /// are.
    pub other_balls: Vec<MirrorBall>,
    /// Sheets of markers that were seen in this picture.
    pub papers: Vec<Paper>,
    /// Other real things, the desk itself included.
    pub phantoms: Arc<Vec<PhantomSolid>>,
    /// Most that clipped light is multiplied with.
    pub max_gain: f32,
}

/// One piece of the sky that the camera clipped, and what it was found to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolvedRegion {
    /// Towards its middle, unit vector in world space.
    pub direction: Vec3,
    /// Steradian.
    pub solid_angle: f32,
    /// How many times brighter than white, per channel; at least 1.
    pub gain: Vec3,
    /// Where it is, world space, metres, if the desk tells that it is near: shadows fan out and light falls off. `None` far away.
    pub position: Option<Vec3>,
    /// Share of the answer that the equations fix, 0…1; the rest is the prior, least extra light.
    pub confidence: f32,
}

/// Light whose clipped parts have been recovered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SolvedLight {
    /// The clipped pieces.
    pub regions: Vec<SolvedRegion>,
    /// Gain on clipped light towards each cell of a cube.
    pub gains: Vec<Vec3>,
    /// Points that were compared, those of the paper included.
    pub points: usize,
    /// Of these, points of markers' paper.
    pub paper_points: usize,
    /// Root of the mean squared relative difference between the desk as the light explains it and as it is (robust).
    pub residual: f32,
    /// Clipped pieces whose light a darker ball shows.
    pub dark_readings: usize,
    /// The paper as the light explains it ÷ as it is, per channel.
    pub paper_ratio: Vec3,
    /// Ratio of the largest to the smallest scale of the equations; large where regions cannot be told apart.
    pub condition: f32,
    pub(super) sky: Vec<SkyCell>,
}

impl DeskPicture {
    /// The lights of a solution for this picture, strongest first: [`SolvedLight::lights`] with the places that a second ball tells of.
    pub fn lights(&self, solved: &SolvedLight) -> Vec<FoundLight> {
        let mut lights = solved.lights();
        triangulate(self, &mut lights);
        lights
    }

    /// All balls, the one that shows the sky first.
    pub(super) fn balls(&self) -> Vec<MirrorBall> {
        std::iter::once(self.ball).chain(self.other_balls.iter().copied()).collect()
    }
}

impl SolvedLight {
    /// The sky in small pieces: direction (world space, unit), steradian, radiance in linear camera units with clipped light
    /// recovered.
    pub fn sky(&self) -> impl Iterator<Item = (Vec3, f32, Vec3)> {
        self.sky.iter().zip(&self.gains).map(|(cell, gain)| (cell.dir_world, cell.solid_angle, cell.radiance(*gain)))
    }

    /// Irradiance ÷ π at a surface that sees all of the sky about its normal (world space, unit), linear camera units: what a
    /// white surface of that orientation would shine with.
    pub fn irradiance(&self, normal_world: Vec3) -> Vec3 {
        let lit =
            self.sky().map(|(dir, solid_angle, radiance)| radiance * (solid_angle * dir.dot(normal_world).max(0.0)));
        lit.sum::<Vec3>() / PI
    }

    /// Compact parts of the sky that are much brighter than the rest, strongest first, with the places that the desk tells of.
    pub fn lights(&self) -> Vec<FoundLight> {
        let mut lights = find_lights(&self.sky, &self.gains);
        for light in &mut lights {
            let angle = |region: &SolvedRegion| region.direction.angle_between(light.direction);
            let nearest = self.regions.iter().min_by(|a, b| angle(a).total_cmp(&angle(b)));
            let is_part = |region: &&SolvedRegion| angle(region) < light.angular_radius + SAME_LIGHT;
            light.position = nearest.filter(is_part).and_then(|region| region.position);
        }
        lights
    }
}

/// What does not change from picture to picture while nothing moves.
#[derive(Clone, Debug, Default)]
pub struct SolverCache {
    made_for: Option<(Vec<MirrorBall>, Vec<Paper>, Arc<Vec<PhantomSolid>>, Affine3A)>,
    meter: Meter,
    places: KnownPlaces,
}

/// A light and a region this close are the same, radians beyond the light's radius.
const SAME_LIGHT: f32 = 0.07;
/// Relative uncertainty of a brightness: texture, geometry, light between things.
const UNCERTAINTY: f64 = 0.04;
/// Points darker than this share of the open sky's irradiance are as uncertain as those at it.
const DARKEST: f32 = 0.08;
/// The paper is the only absolute measure: each of its points counts as many.
const PAPER_WEIGHT: f64 = 6.0;
/// Weight of the prior, least extra light: 1 is as much as one point.
const PRIOR: f64 = 1.0;
/// Weight of the prior that regions that touch have the same gain.
const SMOOTHNESS: f64 = 10.0;
/// Weight of the prior that lights have the color of the light as a whole.
const COLOR_PRIOR: f64 = 20.0;
/// Relative uncertainty of what a darker ball shows.
const DARK_UNCERTAINTY: f64 = 0.05;
/// It shows a lamp itself, and counts as so many points of the desk.
const DARK_WEIGHT: f64 = 300.0;
/// How much brighter a lamp is in the middle of what is clipped than near its edge: power of the distance to the edge. Lamps and
/// windows have bright middles and dim rims, and where a soft box is brightest decides how flat its light falls.
const PROFILE: f32 = 1.5;
/// Rounds in which surfaces are told apart, outliers are weighted down and the light is solved.
const ROUNDS: usize = 8;
/// Change of gains, relative to the largest, below which there are no more rounds.
const SETTLED: f64 = 1e-3;
/// The camera or a thing may move this far before what points see is traced anew, metres.
const TRACE_ANEW: f32 = 0.05;

/// Recovers clipped light from how bright the things on the desk are.
///
/// `None` if the ball or every sheet of paper is out of view.
pub fn solve_light(picture: &DeskPicture, cache: &mut SolverCache) -> Option<SolvedLight> {
    let view = BallView::new(picture.camera_from_world.transform_point3(picture.ball.center), picture.ball.radius)?;
    let sky = BallPicture::new(picture, &picture.ball, &view).sky(SKY_EDGE);
    let up_world = picture.papers.first()?.world_from_marker.transform_vector3(Vec3::Y).normalize_or_zero();
    let regions = clipped_regions(&sky, up_world);
    cache.prepare(picture, &sky);
    let problem = Problem::new(picture, &cache.meter, &sky, &regions);
    problem.solve(picture, up_world, &mut cache.places)
}

/// The sky of a picture in which nothing tells how bright clipped light is: it counts as white, times a gain by the cosine to `up_world`.
pub(super) fn unsolved_light(picture: &DeskPicture, gain: Vec3, up_world: Vec3) -> Option<SolvedLight> {
    let view = BallView::new(picture.camera_from_world.transform_point3(picture.ball.center), picture.ball.radius)?;
    let sky = BallPicture::new(picture, &picture.ball, &view).sky(SKY_EDGE);
    let gains = sky.iter().map(|cell| 1.0 + (gain - 1.0) * cell.dir_world.dot(up_world).max(0.0)).collect();
    Some(SolvedLight { gains, sky, ..default() })
}

impl SolverCache {
    fn prepare(&mut self, picture: &DeskPicture, sky: &[SkyCell]) {
        let balls = picture.balls();
        let near = |a: &Affine3A, b: &Affine3A| {
            Vec3::from(a.translation - b.translation).length() < TRACE_ANEW
                && Vec3::from(a.matrix3.y_axis - b.matrix3.y_axis).length() < TRACE_ANEW
        };
        let is_current = self.made_for.as_ref().is_some_and(|(known, papers, phantoms, camera)| {
            known.len() == balls.len()
                && known
                    .iter()
                    .zip(&balls)
                    .all(|(a, b)| a.center.distance(b.center) < 2e-3 && MirrorBall { center: b.center, ..*a } == *b)
                && papers.len() == picture.papers.len()
                && papers.iter().zip(&picture.papers).all(|(a, b)| {
                    a.size == b.size && a.world_from_marker.translation.distance(b.world_from_marker.translation) < 2e-3
                })
                && Arc::ptr_eq(phantoms, &picture.phantoms)
                && near(&camera.inverse(), &picture.camera_from_world.inverse())
        });
        if is_current {
            return;
        }
        let desk = Desk { balls: &balls, papers: &picture.papers, phantoms: &picture.phantoms };
        // The table is megabytes: its memory serves again.
        let memory = std::mem::take(&mut self.meter.weights);
        self.meter = Meter::new(memory, desk, &picture.intrinsics, &picture.camera_from_world, sky);
        self.made_for = Some((balls, picture.papers.clone(), picture.phantoms.clone(), picture.camera_from_world));
    }
}

/// One point, as the picture shows it, and what reaches it per unknown. Index 3 of arrays is the mean of the channels.
pub(super) struct Equation {
    pub point: MeterPoint,
    /// π · radiance; NaN where clipped.
    exitance: [f64; 4],
    /// Irradiance with clipped light taken for white.
    seen: [f64; 4],
    /// What one unit of extra gain adds, per region.
    pub per_gain: Vec<[f64; 4]>,
    /// The same of light that may be brighter only up to its region's limit.
    pub limited: Vec<[f64; 4]>,
    /// Number of the unknown albedo.
    class: Option<usize>,
}

/// The mean of the channels, solved.
pub(super) struct GraySolution {
    /// Extra gain per region.
    pub x: Vec<f64>,
    inverse_albedos: Vec<f64>,
    weights: Vec<f64>,
    equations: NormalEquations,
    /// How badly the desk is explained: the mean of the points' robust costs.
    pub cost: f64,
}

pub(super) struct Problem<'a> {
    pub sky: &'a [SkyCell],
    pub regions: &'a [Region],
    /// Per region, the extra gain from which on limited light grows no more.
    limits: Vec<[f64; 4]>,
    /// Regions that touch: parts of one window, mostly.
    neighbors: Vec<(usize, usize)>,
    pub equations: Vec<Equation>,
    /// What darker balls say: extra gain per region and channel, or at least that.
    readings: Vec<GainReading>,
    /// Per region, how its extra light is shaped.
    pub profiles: Vec<Vec<f32>>,
    /// Where lights are that are not far away.
    pub positions: Vec<Option<Vec3>>,
}

/// Extra gain of a region as a darker ball shows it, per channel.
struct GainReading {
    region: usize,
    gain: [f64; 4],
    is_bound: [bool; 4],
}

/// Gray: the mean of the channels.
pub(super) const GRAY: usize = 3;

fn neighbors(regions: &[Region]) -> Vec<(usize, usize)> {
    let is_near = |a: &Region, b: &Region| a.dir_world.distance(b.dir_world) < 2.0 * (a.spread + b.spread);
    (0..regions.len())
        .flat_map(|r| (r + 1..regions.len()).map(move |s| (r, s)))
        .filter(|&(r, s)| is_near(&regions[r], &regions[s]))
        .collect()
}

fn mean_limit(region: &Region, sky: &[SkyCell]) -> [f64; 4] {
    let (mut sum, mut total) = (Vec3::ZERO, Vec3::ZERO);
    for cell in region.cells.iter().map(|&i| &sky[i]) {
        sum += cell.solid_angle * cell.limited * (cell.limit - 1.0);
        total += cell.solid_angle * cell.limited;
    }
    let mean = |sum: f32, total: f32| if total > 0.0 { f64::from(sum / total) } else { 0.0 };
    let [r, g, b] = [0, 1, 2].map(|c| mean(sum[c], total[c]));
    [r, g, b, mean(sum.element_sum(), total.element_sum())]
}

/// What the darker balls say in terms of the unknowns.
fn gain_readings(readings: Vec<DarkReading>, sky: &[SkyCell], regions: &[Region]) -> Vec<GainReading> {
    let in_gains = |reading: DarkReading| {
        let cells = regions[reading.region].cells.iter().map(|&i| &sky[i]);
        let clipped: Vec3 = cells.map(|cell| cell.solid_angle * (cell.clipped + cell.limited)).sum();
        let (energy, clipped) = (with_gray(reading.energy.as_vec3()), with_gray(clipped));
        let [r, g, b] = reading.is_bound;
        GainReading {
            region: reading.region,
            gain: std::array::from_fn(|c| (energy[c] / clipped[c].max(1e-9) - 1.0).max(0.0)),
            is_bound: [r, g, b, r || g || b],
        }
    };
    readings.into_iter().map(in_gains).collect()
}

pub(super) fn with_gray(v: Vec3) -> [f64; 4] {
    let v = v.as_dvec3();
    [v.x, v.y, v.z, v.element_sum() / 3.0]
}

impl<'a> Problem<'a> {
    fn new(picture: &DeskPicture, meter: &Meter, sky: &'a [SkyCell], regions: &'a [Region]) -> Self {
        let mut region_of = vec![(usize::MAX, 0.0); sky.len()];
        let readings = read_dark_balls(picture, sky, regions);
        let mut profiles = profiles(sky, regions, PROFILE);
        for (reading, shape) in readings.iter().filter_map(|reading| Some((reading, reading.shape.as_ref()?))) {
            profiles[reading.region] = shaped(&regions[reading.region], sky, shape);
        }
        for (r, (region, profile)) in regions.iter().zip(&profiles).enumerate() {
            for (&i, share) in region.cells.iter().zip(profile) {
                region_of[i] = (r, *share);
            }
        }
        let colors = phantom_colors(picture, meter, sky);
        let mut equations = Vec::with_capacity(meter.points.len());
        for (i, point) in meter.points.iter().enumerate() {
            let pos_camera = picture.camera_from_world.transform_point3(point.pos_world);
            let Some(radiance) =
                picture.intrinsics.project(pos_camera).and_then(|pixel| brightness(&picture.frame, pixel))
            else {
                continue;
            };
            let mut seen = Vec3::ZERO;
            let mut per_gain = vec![(Vec3::ZERO, Vec3::ZERO); regions.len()];
            for ((cell, weight), (region, share)) in
                sky.iter().zip(&meter.weights[i * sky.len()..(i + 1) * sky.len()]).zip(&region_of)
            {
                if *weight > 0.0 {
                    seen += *weight * cell.seen;
                    if let Some(sum) = per_gain.get_mut(*region) {
                        sum.0 += *weight * share * cell.clipped;
                        sum.1 += *weight * share * cell.limited;
                    }
                }
            }
            for (phantom, share) in &meter.hidden[i] {
                seen += *share * colors[*phantom];
            }
            equations.push(Equation {
                point: *point,
                exitance: with_gray(PI * radiance),
                seen: with_gray(seen),
                per_gain: per_gain.iter().map(|(free, _)| with_gray(*free)).collect(),
                limited: per_gain.iter().map(|(_, limited)| with_gray(*limited)).collect(),
                class: None,
            });
        }
        let limits = regions.iter().map(|region| mean_limit(region, sky)).collect();
        let readings = gain_readings(readings, sky, regions);
        Self {
            sky,
            regions,
            limits,
            neighbors: neighbors(regions),
            equations,
            readings,
            profiles,
            positions: vec![None; regions.len()],
        }
    }

    /// Irradiance with clipped light raised.
    fn irradiance(&self, equation: &Equation, channel: usize, x: &[f64]) -> f64 {
        equation.seen[channel] + self.extra(equation, channel, x)
    }

    /// What the extra gains add.
    fn extra(&self, equation: &Equation, channel: usize, x: &[f64]) -> f64 {
        let parts = equation.per_gain.iter().zip(&equation.limited).zip(&self.limits).zip(x);
        parts.map(|(((free, limited), limit), x)| free[channel] * x + limited[channel] * x.min(limit[channel])).sum()
    }

    fn solve(mut self, picture: &DeskPicture, up_world: Vec3, places: &mut KnownPlaces) -> Option<SolvedLight> {
        let regions = self.regions.len();
        let paper_points = self.equations.iter().filter(|e| e.point.surface == Surface::Paper).count();
        if paper_points == 0 {
            return None;
        }
        let gray = self.solve_gray(None);
        let GraySolution { x, inverse_albedos, weights, equations, .. } = self.place_near_lights(picture, places, gray);
        let most = f64::from(picture.max_gain) - 1.0;
        let mut gains = vec![Vec3::ONE; regions];
        let mut paper_ratio = Vec3::ONE;
        for channel in 0..3 {
            let tint = self.tint(channel, &x);
            let prior: Vec<f64> = x.iter().map(|x| x * tint).collect();
            let mut solved = prior.clone();
            let mut albedos = self.albedos(channel, &solved);
            for _ in 0..3 {
                let weights = self.robust_weights(channel, &solved, &albedos);
                let all = self.solve_channel(channel, &solved, &albedos, &weights, Some(&prior)).0;
                solved = all[..regions].to_vec();
                albedos = all[regions..].to_vec();
            }
            for (gain, x) in gains.iter_mut().zip(&solved) {
                gain[channel] = 1.0 + x.min(most) as f32;
            }
            paper_ratio[channel] = self.paper_ratio(channel, &solved);
        }
        let residual = {
            let open = self.open_irradiance(GRAY, &x);
            let (mut sum, mut total) = (0.0, 0.0);
            for (equation, weight) in self.equations.iter().zip(&weights) {
                if let Some(r) = self.relative_error(equation, GRAY, &x, &inverse_albedos, open) {
                    sum += weight * r * r;
                    total += weight;
                }
            }
            (sum / f64::max(total, 1e-9)).sqrt() as f32
        };
        let priors = self.priors(GRAY);
        let inverse = equations.inverse();
        let confidence = |r: usize| {
            inverse.as_ref().map_or(0.0, |inverse| {
                let n = regions + inverse_albedos.len();
                (1.0 - priors[r] * inverse[r * n + r]).clamp(0.0, 1.0) as f32
            })
        };
        let condition = inverse.as_ref().map_or(f32::INFINITY, |inverse| {
            let n = regions + inverse_albedos.len();
            (0..n).map(|i| inverse[i * n + i] * equations.diagonal(i)).fold(1.0, f64::max) as f32
        });
        let solved_regions = self
            .regions
            .iter()
            .enumerate()
            .map(|(r, region)| SolvedRegion {
                direction: region.dir_world,
                solid_angle: region.solid_angle,
                gain: gains[r],
                position: self.positions[r],
                confidence: confidence(r),
            })
            .collect();
        Some(SolvedLight {
            regions: solved_regions,
            gains: spread_gains(self.sky, self.regions, &self.profiles, &gains, up_world),
            points: self.equations.len(),
            paper_points,
            dark_readings: self.readings.iter().filter(|reading| !reading.is_bound[GRAY]).count(),
            residual,
            paper_ratio,
            condition,
            sky: self.sky.to_vec(),
        })
    }

    /// Solves the mean of the channels.
    pub(super) fn solve_gray(&mut self, start: Option<&[f64]>) -> GraySolution {
        let regions = self.regions.len();
        let mut inverse_albedos: Vec<f64> = Vec::new();
        let mut weights = vec![1.0; self.equations.len()];
        let mut x = match start {
            Some(start) => start.to_vec(),
            // First the paper alone: the least extra light that explains it.
            None => self.solve_channel(GRAY, &vec![0.0; regions], &inverse_albedos, &weights, None).0,
        };
        let mut equations = NormalEquations::new(0);
        for _ in 0..ROUNDS {
            inverse_albedos = self.classify(&x);
            weights = self.robust_weights(GRAY, &x, &inverse_albedos);
            let solved;
            (solved, equations) = self.solve_channel(GRAY, &x, &inverse_albedos, &weights, None);
            let largest = x.iter().fold(1.0, |most, x| f64::max(most, *x));
            let is_settled = x.iter().zip(&solved).all(|(before, now)| (before - now).abs() < SETTLED * largest);
            x = solved[..regions].to_vec();
            inverse_albedos = solved[regions..].to_vec();
            if is_settled {
                break;
            }
        }
        let open = self.open_irradiance(GRAY, &x);
        let errors = self.equations.iter().filter_map(|e| self.relative_error(e, GRAY, &x, &inverse_albedos, open));
        let (sum, count) = errors.fold((0.0, 0.0), |(sum, count), error| {
            (sum + (1.0 + (error / (2.0 * UNCERTAINTY)).powi(2)).ln(), count + 1.0)
        });
        GraySolution { x, inverse_albedos, weights, equations, cost: sum / f64::max(count, 1.0) }
    }

    /// Weight of the prior on each region's extra gain.
    fn priors(&self, channel: usize) -> Vec<f64> {
        // The unit: extra light of one radiance from all regions that would be needed for the paper.
        let energies: Vec<f64> = self
            .regions
            .iter()
            .map(|region| {
                let sum = region.cells.iter().map(|&i| {
                    let clipped = with_gray(self.sky[i].clipped + self.sky[i].limited)[channel];
                    f64::from(self.sky[i].solid_angle) * clipped * clipped
                });
                sum.sum::<f64>().max(1e-6)
            })
            .collect();
        let (mut wanted, mut count) = (0.0, 0.0);
        for equation in self.equations.iter().filter(|e| e.point.surface == Surface::Paper) {
            let reflectance = equation.point.reflectance.map_or(1.0, |r| with_gray(r)[channel]);
            let missing = equation.exitance[channel] / reflectance - equation.seen[channel];
            let per_gain: f64 =
                equation.per_gain.iter().zip(&equation.limited).map(|(a, b)| a[channel] + b[channel]).sum();
            if missing.is_finite() && per_gain > 0.0 {
                wanted += (missing / per_gain).max(0.1);
                count += 1.0;
            }
        }
        let unit: f64 = if count > 0.0 { wanted / count } else { 1.0 };
        let total: f64 = energies.iter().sum();
        energies.iter().map(|energy| PRIOR * energy / (total * unit * unit)).collect()
    }

    /// The least extra gain per region and the inverse albedos.
    fn solve_channel(
        &self,
        channel: usize,
        x: &[f64],
        inverse_albedos: &[f64],
        weights: &[f64],
        prior: Option<&[f64]>,
    ) -> (Vec<f64>, NormalEquations) {
        let regions = self.regions.len();
        let n = regions + inverse_albedos.len();
        let mut system = NormalEquations::new(n);
        let open = self.open_irradiance(channel, x);
        let mut row: Vec<(usize, f64)> = Vec::with_capacity(regions + 1);
        for (equation, robust) in self.equations.iter().zip(weights) {
            let exitance = equation.exitance[channel];
            if !exitance.is_finite() {
                continue;
            }
            let reflectance = equation.point.reflectance.map(|r| with_gray(r)[channel]);
            row.clear();
            // Light at its limit is a part of what is seen.
            let mut seen = equation.seen[channel];
            for (r, (free, limited)) in equation.per_gain.iter().zip(&equation.limited).enumerate() {
                let limit = self.limits[r][channel];
                if x[r] < limit {
                    row.push((r, free[channel] + limited[channel]));
                } else {
                    row.push((r, free[channel]));
                    seen += limit * limited[channel];
                }
            }
            let wanted = match (reflectance, equation.class) {
                (Some(reflectance), _) => exitance / reflectance - seen,
                (None, Some(class)) if class < inverse_albedos.len() => {
                    row.push((regions + class, -exitance));
                    -seen
                }
                _ => continue,
            };
            let scale = self.irradiance(equation, channel, x).max(f64::from(DARKEST) * open);
            let own = if equation.point.surface == Surface::Paper { PAPER_WEIGHT } else { 1.0 };
            system.add(&row, wanted, own * robust / (UNCERTAINTY * scale).powi(2));
        }
        let factor = if prior.is_some() { COLOR_PRIOR } else { 1.0 };
        let priors = self.priors(channel);
        for (r, weight) in priors.iter().enumerate() {
            system.add(&[(r, 1.0)], prior.map_or(0.0, |prior| prior[r]), factor * weight);
        }
        for &(r, s) in &self.neighbors {
            system.add(&[(r, 1.0), (s, -1.0)], 0.0, SMOOTHNESS * priors[r].min(priors[s]));
        }
        for k in 0..inverse_albedos.len() {
            system.add(&[(regions + k, 1.0)], 2.0, 1e-6);
        }
        let mut floor = vec![0.0; n];
        for GainReading { region, gain, is_bound } in &self.readings {
            if is_bound[channel] {
                floor[*region] = f64::max(floor[*region], gain[channel]);
            } else {
                let uncertainty = DARK_UNCERTAINTY * (gain[channel] + 1.0);
                system.add(&[(*region, 1.0)], gain[channel], DARK_WEIGHT / uncertainty.powi(2));
            }
        }
        let start: Vec<f64> = x.iter().chain(inverse_albedos).copied().collect();
        (system.solve(&start, &floor), system)
    }

    /// Mean irradiance of the paper.
    pub(super) fn open_irradiance(&self, channel: usize, x: &[f64]) -> f64 {
        let papers = self.equations.iter().filter(|e| e.point.surface == Surface::Paper);
        let (sum, count) = papers.fold((0.0, 0.0), |(s, n), e| (s + self.irradiance(e, channel, x), n + 1.0));
        f64::max(sum / f64::max(count, 1.0), 1e-6)
    }

    /// Color of the light that is missing ÷ its gray.
    fn tint(&self, channel: usize, x: &[f64]) -> f64 {
        let (mut missing, mut explained) = (0.0, 0.0);
        for equation in self.equations.iter().filter(|e| e.point.surface == Surface::Paper) {
            let reflectance = equation.point.reflectance.map_or(1.0, |r| with_gray(r)[channel]);
            let lacks = equation.exitance[channel] / reflectance - equation.seen[channel];
            if lacks.is_finite() {
                missing += lacks;
                explained += self.extra(equation, channel, x);
            }
        }
        if explained > 0.0 { (missing / explained).clamp(0.1, 10.0) } else { 1.0 }
    }

    fn paper_ratio(&self, channel: usize, x: &[f64]) -> f32 {
        let (mut ours, mut theirs) = (0.0, 0.0);
        for equation in self.equations.iter().filter(|e| e.point.surface == Surface::Paper) {
            let wanted = equation.exitance[channel] / equation.point.reflectance.map_or(1.0, |r| with_gray(r)[channel]);
            if wanted.is_finite() {
                ours += self.irradiance(equation, channel, x);
                theirs += wanted;
            }
        }
        if theirs > 0.0 { (ours / theirs) as f32 } else { 1.0 }
    }

    /// Relative difference of a point from its explanation.
    fn relative_error(
        &self,
        equation: &Equation,
        channel: usize,
        x: &[f64],
        inverse_albedos: &[f64],
        open: f64,
    ) -> Option<f64> {
        let inverse = match equation.point.reflectance {
            Some(reflectance) => 1.0 / with_gray(reflectance)[channel],
            None => *inverse_albedos.get(equation.class?)?,
        };
        let irradiance = self.irradiance(equation, channel, x);
        let scale = irradiance.max(f64::from(DARKEST) * open);
        let error = (equation.exitance[channel] * inverse - irradiance) / scale;
        error.is_finite().then_some(error)
    }

    /// Cauchy weights: texture and unmodeled light are outliers.
    fn robust_weights(&self, channel: usize, x: &[f64], inverse_albedos: &[f64]) -> Vec<f64> {
        let open = self.open_irradiance(channel, x);
        let errors: Vec<Option<f64>> =
            self.equations.iter().map(|e| self.relative_error(e, channel, x, inverse_albedos, open)).collect();
        let mut sizes: Vec<f64> = errors.iter().flatten().map(|e| e.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let typical = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0).max(UNCERTAINTY);
        errors
            .into_iter()
            .zip(&self.equations)
            .map(|(error, equation)| match error {
                Some(_) if equation.point.surface == Surface::Paper => 1.0,
                Some(error) => 1.0 / (1.0 + (error / (2.0 * typical)).powi(2)),
                None => 0.0,
            })
            .collect()
    }

    /// Inverse albedo of each class in a channel: the median.
    fn albedos(&self, channel: usize, x: &[f64]) -> Vec<f64> {
        let classes = self.equations.iter().filter_map(|e| e.class).max().map_or(0, |most| most + 1);
        (0..classes)
            .map(|class| {
                let mut ratios: Vec<f64> = self
                    .equations
                    .iter()
                    .filter(|e| e.class == Some(class))
                    .map(|e| self.irradiance(e, channel, x) / e.exitance[channel].max(1e-9))
                    .filter(|ratio| ratio.is_finite())
                    .collect();
                ratios.sort_by(f64::total_cmp);
                ratios.get(ratios.len() / 2).copied().unwrap_or(2.0)
            })
            .collect()
    }

    /// Tells surfaces of different albedo apart, and returns their inverse albedos.
    fn classify(&mut self, x: &[f64]) -> Vec<f64> {
        let logs: Vec<f64> = self
            .equations
            .iter()
            .map(|e| (e.exitance[GRAY].max(1e-6) / self.irradiance(e, GRAY, x).max(1e-6)).ln())
            .collect();
        let mut phantoms: Vec<usize> = self
            .equations
            .iter()
            .filter_map(|e| match e.point.surface {
                Surface::Phantom(k) => Some(k),
                Surface::Paper => None,
            })
            .collect();
        phantoms.sort_unstable();
        phantoms.dedup();
        let mut classes = 0;
        for phantom in phantoms {
            let members: Vec<usize> = (0..self.equations.len())
                .filter(|&i| {
                    let e = &self.equations[i];
                    e.point.surface == Surface::Phantom(phantom) && e.point.reflectance.is_none() && logs[i].is_finite()
                })
                .collect();
            if members.len() < LEAST_POINTS {
                for i in members {
                    self.equations[i].class = None;
                }
                continue;
            }
            let threshold = two_albedos(&members.iter().map(|&i| logs[i]).collect::<Vec<_>>());
            for i in members {
                let class = threshold.map_or(0, |limit| usize::from(logs[i] > limit));
                self.equations[i].class = Some(classes + class);
            }
            classes += if threshold.is_some() { 2 } else { 1 };
        }
        self.albedos(GRAY, x)
    }
}

/// Phantoms with fewer points in view tell nothing.
const LEAST_POINTS: usize = 8;
/// Two albedos differ by at least this much (logarithm), and by this many times the scatter of each.
const LEAST_CONTRAST: (f64, f64) = (0.08, 3.2);

/// Where logarithms of albedos fall into two groups: the border between them.
fn two_albedos(logs: &[f64]) -> Option<f64> {
    let mut sorted = logs.to_vec();
    sorted.sort_by(f64::total_cmp);
    // Tails are shadows and shine, no albedos.
    let n = sorted.len();
    let core = &sorted[n / 20..n - n / 20];
    let sums: Vec<f64> = core
        .iter()
        .scan(0.0, |sum, v| {
            *sum += v;
            Some(*sum)
        })
        .collect();
    let (total, count) = (*sums.last()?, core.len() as f64);
    // Otsu 1979: the border with the largest variance between the groups.
    let best = (core.len() / 10..core.len() - core.len() / 10).max_by(|&i, &j| {
        let between = |i: usize| {
            let (left, right) = (i as f64 + 1.0, count - i as f64 - 1.0);
            left * right * (sums[i] / left - (total - sums[i]) / right.max(1.0)).powi(2)
        };
        between(i).total_cmp(&between(j))
    })?;
    let scatter = |part: &[f64]| {
        let median = part[part.len() / 2];
        let mut sizes: Vec<f64> = part.iter().map(|v| (v - median).abs()).collect();
        sizes.sort_by(f64::total_cmp);
        (median, 1.48 * sizes[sizes.len() / 2])
    };
    let (left, right) = core.split_at(best + 1);
    if left.is_empty() || right.is_empty() {
        return None;
    }
    let ((low, low_scatter), (high, high_scatter)) = (scatter(left), scatter(right));
    let gap = high - low;
    (gap > LEAST_CONTRAST.0 && gap > LEAST_CONTRAST.1 * 0.5 * (low_scatter + high_scatter))
        .then_some(0.5 * (low + high))
}

/// Mean radiance of each phantom where the picture shows it; below the horizon's where it does not.
fn phantom_colors(picture: &DeskPicture, meter: &Meter, sky: &[SkyCell]) -> Vec<Vec3> {
    let up = picture.papers.first().map_or(Vec3::Y, |paper| paper.world_from_marker.transform_vector3(Vec3::Y));
    let (below, total) = sky
        .iter()
        .filter(|cell| cell.dir_world.dot(up) < 0.0)
        .fold((Vec3::ZERO, 0.0), |(sum, total), cell| (sum + cell.seen * cell.solid_angle, total + cell.solid_angle));
    let mut sums = vec![(Vec3::ZERO, 0.0_f32); picture.phantoms.len()];
    for point in &meter.points {
        let Surface::Phantom(k) = point.surface else {
            continue;
        };
        let pixel = picture.intrinsics.project(picture.camera_from_world.transform_point3(point.pos_world));
        if let Some(pixel) = pixel.filter(|p| p.cmpge(Vec2::ZERO).all() && p.cmplt(picture.frame.size.as_vec2()).all())
        {
            sums[k].0 += picture.frame.linear(pixel.x as i32, pixel.y as i32);
            sums[k].1 += 1.0;
        }
    }
    sums.into_iter().map(|(sum, count)| if count > 0.0 { sum / count } else { below / f32::max(total, 1e-6) }).collect()
}

/// Cells beside a region take its gain, since its edge runs through them: twice around.
const SPREADING: usize = 2;

fn spread_gains(
    sky: &[SkyCell],
    regions: &[Region],
    profiles: &[Vec<f32>],
    gains: &[Vec3],
    up_world: Vec3,
) -> Vec<Vec3> {
    let mut all = vec![None; sky.len()];
    for ((region, profile), gain) in regions.iter().zip(profiles).zip(gains) {
        for (&i, share) in region.cells.iter().zip(profile) {
            all[i] = Some(1.0 + *share * (*gain - 1.0));
        }
    }
    for _ in 0..SPREADING {
        let before = all.clone();
        let known: Vec<usize> = (0..sky.len()).filter(|&i| before[i].is_some()).collect();
        for i in (0..sky.len()).filter(|&i| before[i].is_none() && sky[i].dir_world.dot(up_world) > 0.0) {
            let reach = 1.7 * sky[i].solid_angle.sqrt();
            let nearest = known
                .iter()
                .map(|&j| (j, sky[j].dir_world.distance_squared(sky[i].dir_world)))
                .filter(|(_, distance)| *distance < reach * reach)
                .min_by(|a, b| a.1.total_cmp(&b.1));
            all[i] = nearest.and_then(|(j, _)| before[j]);
        }
    }
    all.into_iter().map(|gain| gain.unwrap_or(Vec3::ONE)).collect()
}
