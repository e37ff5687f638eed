//! Robust fit of the least extra light that explains the desk: regularized, iteratively reweighted least squares, per
//! channel.
//!
//! The mean of the channels is fitted first, in rounds that classify albedos and reduce the weight of outliers. It is
//! the prior of each channel.

use super::{
    albedos::AlbedoEvidence,
    equations::{Equation, GRAY, GainReading, Problem, with_gray},
    sample_points::Surface,
};
use crate::{least_squares::NormalEquations, median::median_by};
use std::ops::RangeInclusive;

/// Fit of the mean of the channels.
pub(super) struct GrayFit {
    /// Extra gain per region.
    pub x: Vec<f64>,
    pub inverse_albedos: Vec<f64>,
    pub weights: Vec<f64>,
    pub equations: NormalEquations,
    /// Mean of the points' robust costs; the larger, the worse the desk is explained.
    pub cost: f64,
}

/// Relative uncertainty of a point's brightness, from texture, geometry and unmodeled light between objects.
const UNCERTAINTY: f64 = 0.04;
/// Smallest irradiance, relative to that of the open sky, to which errors are relative. Darker points use this value.
const MIN_RELATIVE_IRRADIANCE: f32 = 0.08;
/// Weight of a paper point. The paper is the only absolute measure, so each of its points counts as several.
const PAPER_WEIGHT: f64 = 6.0;
/// Weight of the prior of least extra light; 1 equals one point.
const PRIOR_WEIGHT: f64 = 1.0;
/// Factor on the prior of a small light, whose gain is hundreds of times that of a wide light of the same energy. The
/// shadows that show where it is also show how strong it is.
const SMALL_LIGHT_PRIOR: f64 = 1e-6;
/// Weight of the prior that adjacent regions have the same gain.
const SMOOTHNESS_WEIGHT: f64 = 10.0;
/// Weight of the prior that each light has the color of the light as a whole.
const COLOR_PRIOR_WEIGHT: f64 = 4.0;
/// Largest solid angle of a lamp, steradian. Wider lights may be parts of the sky.
const MAX_LAMP_SOLID_ANGLE: f32 = 0.02;
/// Largest factor between the gain of a lamp in a channel and that with the color of the light as a whole. Without it,
/// the errors of everything else can make a faint lamp blue or green.
const MAX_LAMP_TINT: f64 = 1.5;
/// Relative uncertainty of a reading from a darker view.
const READING_UNCERTAINTY: f64 = 0.05;
/// Weight of a reading, in points of the desk. It shows the lamp itself.
const READING_WEIGHT: f64 = 300.0;
/// Largest number of rounds; each classifies albedos, weights outliers down and solves the light.
const MAX_ROUNDS: usize = 8;
/// Largest change of the gains, relative to the largest gain, at which the rounds end.
const MAX_SETTLED_CHANGE: f64 = 1e-3;

impl Problem<'_> {
    /// Fits the mean of the channels.
    pub(super) fn fit_gray(&mut self, start: Option<&[f64]>) -> GrayFit {
        let regions = self.regions.len();
        let mut inverse_albedos: Vec<f64> = Vec::new();
        let mut weights = vec![1.0; self.equations.len()];
        let mut x = match start {
            Some(start) => start.to_vec(),
            // Start from the paper alone: the least extra light that explains it.
            None => self.fit_channel(GRAY, &vec![0.0; regions], &inverse_albedos, &weights, None).0,
        };
        let mut equations = NormalEquations::new(0);
        let mut evidence = AlbedoEvidence::Color;
        for round in 0..MAX_ROUNDS {
            inverse_albedos = self.classify(&x, evidence);
            weights = self.cauchy_weights(GRAY, &x, &inverse_albedos);
            let solved;
            (solved, equations) = self.fit_channel(GRAY, &x, &inverse_albedos, &weights, None);
            let largest = x.iter().fold(1.0, |max, x| f64::max(max, *x));
            let is_settled =
                x.iter().zip(&solved).all(|(before, now)| (before - now).abs() < MAX_SETTLED_CHANGE * largest);
            x = solved[..regions].to_vec();
            inverse_albedos = solved[regions..].to_vec();
            match evidence {
                AlbedoEvidence::Color if is_settled || round + 1 == MAX_ROUNDS / 2 => {
                    evidence = AlbedoEvidence::Brightness;
                }
                AlbedoEvidence::Brightness if is_settled => break,
                _ => {}
            }
        }
        let open = self.open_irradiance(GRAY, &x);
        let errors = self.equations.iter().filter_map(|e| self.relative_error(e, GRAY, &x, &inverse_albedos, open));
        let (sum, count) = errors.fold((0.0, 0.0), |(sum, count), error| {
            (sum + (1.0 + (error / (2.0 * UNCERTAINTY)).powi(2)).ln(), count + 1.0)
        });
        GrayFit { x, inverse_albedos, weights, equations, cost: sum / f64::max(count, 1.0) }
    }

    /// Weight of the prior on each region's extra gain.
    pub(super) fn priors(&self, channel: usize) -> Vec<f64> {
        // Unit of the prior: the equal extra gain of all regions that would explain the paper.
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
        let mut priors: Vec<f64> =
            energies.iter().map(|energy| PRIOR_WEIGHT * energy / (total * unit * unit)).collect();
        if let Some(region) = self.small_region() {
            priors[region] *= SMALL_LIGHT_PRIOR;
        }
        priors
    }

    /// Fits the least extra gain per region and the inverse albedos.
    pub(super) fn fit_channel(
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
            // Limited light at its limit is a constant part of the irradiance.
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
            let wanted = match (reflectance, equation.albedo_class) {
                (Some(reflectance), _) => exitance / reflectance - seen,
                (None, Some(albedo_class)) if albedo_class < inverse_albedos.len() => {
                    row.push((regions + albedo_class, -exitance));
                    -seen
                }
                _ => continue,
            };
            let scale = self.irradiance(equation, channel, x).max(f64::from(MIN_RELATIVE_IRRADIANCE) * open);
            let own = if equation.point.surface == Surface::Paper { PAPER_WEIGHT } else { 1.0 };
            system.add(&row, wanted, own * robust / (UNCERTAINTY * scale).powi(2));
        }
        let factor = if prior.is_some() { COLOR_PRIOR_WEIGHT } else { 1.0 };
        let priors = self.priors(channel);
        for (r, weight) in priors.iter().enumerate() {
            system.add(&[(r, 1.0)], prior.map_or(0.0, |prior| prior[r]), factor * weight);
        }
        for &(r, s) in &self.neighbors {
            system.add(&[(r, 1.0), (s, -1.0)], 0.0, SMOOTHNESS_WEIGHT * priors[r].min(priors[s]));
        }
        for k in 0..inverse_albedos.len() {
            system.add(&[(regions + k, 1.0)], 2.0, 1e-6);
        }
        let mut floor = vec![0.0; n];
        for (r, expected) in prior.into_iter().flatten().enumerate() {
            floor[r] = *self.gains_of_lamp(r, *expected).start();
        }
        for GainReading { region, gain, is_bound } in &self.readings {
            if is_bound[channel] {
                floor[*region] = f64::max(floor[*region], gain[channel]);
            } else {
                let uncertainty = READING_UNCERTAINTY * (gain[channel] + 1.0);
                system.add(&[(*region, 1.0)], gain[channel], READING_WEIGHT / uncertainty.powi(2));
            }
        }
        let start: Vec<f64> = x.iter().chain(inverse_albedos).copied().collect();
        (system.solve(&start, &floor), system)
    }

    /// Extra gains that a region may have in a channel, given that with the color of the light as a whole: lamps are
    /// close to white, unless a darker view shows their color. Skies may have any color, and so may the sun.
    pub(super) fn gains_of_lamp(&self, region: usize, expected: f64) -> RangeInclusive<f64> {
        let is_lamp = self.regions[region].solid_angle < MAX_LAMP_SOLID_ANGLE
            && self.small_region() != Some(region)
            && self.readings.iter().all(|reading| reading.region != region);
        if is_lamp { expected / MAX_LAMP_TINT..=expected * MAX_LAMP_TINT } else { 0.0..=f64::INFINITY }
    }

    /// Color of the missing light ÷ its gray.
    pub(super) fn tint(&self, channel: usize, x: &[f64]) -> f64 {
        let (mut missing, mut explained) = (0.0, 0.0);
        for equation in self.equations.iter().filter(|e| e.point.surface == Surface::Paper) {
            let reflectance = equation.point.reflectance.map_or(1.0, |r| with_gray(r)[channel]);
            let lacking = equation.exitance[channel] / reflectance - equation.seen[channel];
            if lacking.is_finite() {
                missing += lacking;
                explained += self.extra(equation, channel, x);
            }
        }
        if explained > 0.0 { (missing / explained).clamp(0.1, 10.0) } else { 1.0 }
    }

    /// Relative error of a point's brightness under a solution.
    pub(super) fn relative_error(
        &self,
        equation: &Equation,
        channel: usize,
        x: &[f64],
        inverse_albedos: &[f64],
        open: f64,
    ) -> Option<f64> {
        let inverse = match equation.point.reflectance {
            Some(reflectance) => 1.0 / with_gray(reflectance)[channel],
            None => *inverse_albedos.get(equation.albedo_class?)?,
        };
        let irradiance = self.irradiance(equation, channel, x);
        let scale = irradiance.max(f64::from(MIN_RELATIVE_IRRADIANCE) * open);
        let error = (equation.exitance[channel] * inverse - irradiance) / scale;
        error.is_finite().then_some(error)
    }

    /// Cauchy weights, which reduce the influence of texture and unmodeled light.
    pub(super) fn cauchy_weights(&self, channel: usize, x: &[f64], inverse_albedos: &[f64]) -> Vec<f64> {
        let open = self.open_irradiance(channel, x);
        let errors: Vec<Option<f64>> =
            self.equations.iter().map(|e| self.relative_error(e, channel, x, inverse_albedos, open)).collect();
        let mut sizes: Vec<f64> = errors.iter().flatten().map(|e| e.abs()).collect();
        let typical = median_by(&mut sizes, f64::total_cmp).unwrap_or(0.0).max(UNCERTAINTY);
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
}
