//! Recipe of the solver: from a frame and the things on the desk to the brightness of clipped lights.

use super::{
    desk_frame::{DeskFrame, DeskGeometry, MirrorBall, Paper},
    equations::{GRAY, Problem},
    light_transport::LightTransport,
    near_light::KnownDistances,
    radiance_cells::{BallInFrame, CELLS_PER_EDGE, RadianceCell},
    ray_cast::PhantomSolid,
    regions::clipped_regions,
    robust_fit::GrayFit,
    sample_points::Surface,
    small_light::{SmallLight, SmallLightSearch},
    solved_light::{PointLight, SolvedLight, SolvedRegion, cell_gains},
};
use crate::probe::BallView;
use glam::{Affine3A, Vec3};
use std::sync::Arc;

/// Data that stay the same from frame to frame while nothing moves.
#[derive(Clone, Debug, Default)]
pub struct SolverCache {
    made_for: Option<(Vec<MirrorBall>, Vec<Paper>, Arc<Vec<PhantomSolid>>, Affine3A)>,
    transport: LightTransport,
    distances: KnownDistances,
    small_light: SmallLightSearch,
}

/// Rounds in which each channel weights outliers down and solves the light.
const CHANNEL_ROUNDS: usize = 6;
/// Largest motion of the camera at which the visibility of the points is not traced again, meters.
const MAX_CACHED_MOTION: f32 = 0.05;

/// Recovers clipped light from the brightness of the things on the desk.
///
/// Returns `None` if the ball or every sheet of paper is out of view.
pub fn solve_light(desk: &DeskFrame, cache: &mut SolverCache) -> Option<SolvedLight> {
    let view = BallView::new(desk.camera_from_world.transform_point3(desk.ball.center), desk.ball.radius)?;
    let sky = BallInFrame::new(desk.posed_frame(), &desk.ball, &view).radiance_cells(CELLS_PER_EDGE);
    let up_world = desk.papers.first()?.world_from_marker.transform_vector3(Vec3::Y).normalize_or_zero();
    let regions = clipped_regions(&sky, up_world);
    cache.prepare(desk, &sky);
    let SolverCache { transport, distances, small_light: search, .. } = cache;
    let balls = desk.balls();
    let geometry = DeskGeometry { balls: &balls, papers: &desk.papers, phantoms: &desk.phantoms };
    let solve = |small: Option<SmallLight>, distances: &mut KnownDistances| match small {
        None => Problem::new(desk, transport, &sky, &regions).solve(desk, up_world, distances),
        Some(light) => {
            let regions = light.split_off(&regions, &sky);
            let mut problem = Problem::new(desk, transport, &sky, &regions);
            problem.set_small_light(light, geometry);
            problem.solve(desk, up_world, distances)
        }
    };
    let Some(candidate) = search.candidate(desk, geometry, &sky, &regions, up_world) else {
        return solve(None, distances);
    };
    if candidate.is_known {
        return solve(Some(candidate.light), distances);
    }
    let mut distances_with = KnownDistances::default();
    let (without, with) = (solve(None, distances)?, solve(Some(candidate.light), &mut distances_with)?);
    // A lamp that is near has sharp shadows too, but they fan out.
    let is_near = without.regions.iter().any(|region| {
        region.position.is_some() && region.direction.angle_between(candidate.light.dir_world) < MAX_LAMP_OFFSET
    });
    if !search.decide(candidate.light, !is_near && with.cost < MAX_COST_RATIO * without.cost) {
        return Some(without);
    }
    *distances = distances_with;
    Some(with)
}

/// Largest cost of the desk with a small light, relative to that without, at which there is one.
const MAX_COST_RATIO: f64 = 0.99;
/// Largest angle between a small light and a near lamp that is the same, radians.
const MAX_LAMP_OFFSET: f32 = 0.25;

/// Light of a frame in which nothing reveals the brightness of clipped light. Clipped light is white, times a gain that
/// is weighted by the cosine to `up_world`.
pub(in crate::lighting) fn unsolved_light(desk: &DeskFrame, gain: Vec3, up_world: Vec3) -> Option<SolvedLight> {
    let view = BallView::new(desk.camera_from_world.transform_point3(desk.ball.center), desk.ball.radius)?;
    let sky = BallInFrame::new(desk.posed_frame(), &desk.ball, &view).radiance_cells(CELLS_PER_EDGE);
    let gains = sky.iter().map(|cell| 1.0 + (gain - 1.0) * cell.dir_world.dot(up_world).max(0.0)).collect();
    Some(SolvedLight { gains, sky, ..Default::default() })
}

impl SolverCache {
    fn prepare(&mut self, desk: &DeskFrame, sky: &[RadianceCell]) {
        let balls = desk.balls();
        let near = |a: &Affine3A, b: &Affine3A| {
            Vec3::from(a.translation - b.translation).length() < MAX_CACHED_MOTION
                && Vec3::from(a.matrix3.y_axis - b.matrix3.y_axis).length() < MAX_CACHED_MOTION
        };
        let is_current = self.made_for.as_ref().is_some_and(|(known, papers, phantoms, camera)| {
            known.len() == balls.len()
                && known
                    .iter()
                    .zip(&balls)
                    .all(|(a, b)| a.center.distance(b.center) < 2e-3 && MirrorBall { center: b.center, ..*a } == *b)
                && papers.len() == desk.papers.len()
                && papers.iter().zip(&desk.papers).all(|(a, b)| {
                    a.size == b.size && a.world_from_marker.translation.distance(b.world_from_marker.translation) < 2e-3
                })
                && Arc::ptr_eq(phantoms, &desk.phantoms)
                && near(&camera.inverse(), &desk.camera_from_world.inverse())
        });
        if is_current {
            return;
        }
        let geometry = DeskGeometry { balls: &balls, papers: &desk.papers, phantoms: &desk.phantoms };
        // The table takes megabytes: its memory is reused.
        let memory = std::mem::take(&mut self.transport.weights);
        self.transport = LightTransport::new(memory, geometry, &desk.intrinsics, &desk.camera_from_world, sky);
        self.made_for = Some((balls, desk.papers.clone(), desk.phantoms.clone(), desk.camera_from_world));
    }
}

impl Problem<'_> {
    /// Gain of every cell of the sky, and the small light whose light is in one of the gains.
    fn cell_gains(&self, gains: &[Vec3], up_world: Vec3) -> (Vec<Vec3>, Option<PointLight>) {
        let wide = self.small_region().unwrap_or(self.regions.len());
        let mut all = cell_gains(self.sky, &self.regions[..wide], &self.profiles, &gains[..wide], up_world);
        let point_light = self.small_light.zip(gains.get(wide)).map(|(light, gain)| {
            let (gain_behind, cell) = (all[light.cell], &self.sky[light.cell]);
            all[light.cell] = gain.max(gain_behind);
            let irradiance = cell.solid_angle * (all[light.cell] - gain_behind) * cell.clipped;
            let SmallLight { dir_world: direction, angular_radius, cell, .. } = light;
            PointLight { direction, irradiance, angular_radius, cell, gain_behind }
        });
        (all, point_light)
    }

    fn solve(mut self, desk: &DeskFrame, up_world: Vec3, distances: &mut KnownDistances) -> Option<SolvedLight> {
        let regions = self.regions.len();
        let paper_points = self.equations.iter().filter(|e| e.point.surface == Surface::Paper).count();
        if paper_points == 0 {
            return None;
        }
        let gray = self.fit_gray(None);
        let gray = self.fit_small_light(gray);
        let GrayFit { x, inverse_albedos, weights, equations, cost } = self.locate_near_lights(desk, distances, gray);
        let max_gain = |region: usize| match self.small_region() {
            // All of the cell's light comes from a small part of it.
            Some(small) if small == region => f64::INFINITY,
            _ => f64::from(desk.max_gain) - 1.0,
        };
        let mut gains = vec![Vec3::ONE; regions];
        let mut paper_ratio = Vec3::ONE;
        for channel in 0..3 {
            let tint = self.tint(channel, &x);
            let prior: Vec<f64> = x.iter().map(|x| x * tint).collect();
            let mut solved = prior.clone();
            let mut albedos = self.albedos(channel, &solved);
            for _ in 0..CHANNEL_ROUNDS {
                let weights = self.cauchy_weights(channel, &solved, &albedos);
                let all = self.fit_channel(channel, &solved, &albedos, &weights, Some(&prior)).0;
                solved = all[..regions].to_vec();
                albedos = all[regions..].to_vec();
            }
            for (region, (gain, x)) in gains.iter_mut().zip(&solved).enumerate() {
                let max_of_lamp = *self.gains_of_lamp(region, prior[region]).end();
                gain[channel] = 1.0 + x.min(max_of_lamp).min(max_gain(region)) as f32;
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
        let (gains, point_light) = self.cell_gains(&gains, up_world);
        Some(SolvedLight {
            regions: solved_regions,
            gains,
            point_light,
            cost,
            points: self.equations.len(),
            paper_points,
            bracketed_regions: (0..regions).filter(|&r| self.is_read(r)).count(),
            residual,
            paper_ratio,
            condition,
            sky: self.sky.to_vec(),
        })
    }
}
