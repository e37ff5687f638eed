//! Unknown albedos: one or two classes per phantom, separated by brightness under the light of the current round.

use super::{
    equations::{Equation, GRAY, Problem},
    sample_points::Surface,
};
use crate::median::median_by;
use glam::Vec3;

impl Problem<'_> {
    /// Inverse albedo of each class in a channel: the median over its points.
    pub(super) fn albedos(&self, channel: usize, x: &[f64]) -> Vec<f64> {
        let classes = self.equations.iter().filter_map(|e| e.albedo_class).max().map_or(0, |max| max + 1);
        (0..classes)
            .map(|albedo_class| {
                let mut ratios: Vec<f64> = self
                    .equations
                    .iter()
                    .filter(|e| e.albedo_class == Some(albedo_class))
                    .map(|e| self.irradiance(e, channel, x) / e.exitance[channel].max(1e-9))
                    .filter(|ratio| ratio.is_finite())
                    .collect();
                median_by(&mut ratios, f64::total_cmp).unwrap_or(2.0)
            })
            .collect()
    }

    fn log_albedo(&self, e: &Equation, channel: usize, x: &[f64]) -> f64 {
        (e.exitance[channel].max(1e-6) / self.irradiance(e, channel, x).max(1e-6)).ln()
    }

    /// By how much the color of two groups of points differs in a channel, beside their brightness.
    fn tint_contrast(&self, a: &[&Equation], b: &[&Equation], channel: usize, x: &[f64]) -> f64 {
        let tint = |points: &[&Equation]| {
            let tint = |e: &&Equation| self.log_albedo(e, channel, x) - self.log_albedo(e, GRAY, x);
            let mut tints: Vec<f64> = points.iter().map(tint).collect();
            tints.retain(|tint| tint.is_finite());
            median_by(&mut tints, f64::total_cmp).unwrap_or(0.0)
        };
        (tint(a) - tint(b)).abs()
    }

    /// Assigns points to albedo classes and returns the inverse albedos of the classes.
    pub(super) fn classify(&mut self, x: &[f64], evidence: AlbedoEvidence) -> Vec<f64> {
        let logs: Vec<f64> = self.equations.iter().map(|e| self.log_albedo(e, GRAY, x)).collect();
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
            if members.len() < MIN_POINTS {
                for i in members {
                    self.equations[i].albedo_class = None;
                }
                continue;
            }
            let threshold = albedo_threshold(&members.iter().map(|&i| logs[i]).collect::<Vec<_>>()).filter(|limit| {
                let (bright, dark): (Vec<&Equation>, Vec<&Equation>) =
                    members.iter().map(|&i| &self.equations[i]).partition(|e| self.log_albedo(e, GRAY, x) > *limit);
                evidence == AlbedoEvidence::Brightness
                    || !face_different_ways(&bright, &dark)
                    || (0..3).any(|channel| self.tint_contrast(&bright, &dark, channel, x) > MIN_TINT_CONTRAST)
            });
            for i in members {
                let albedo_class = threshold.map_or(0, |limit| usize::from(logs[i] > limit));
                self.equations[i].albedo_class = Some(classes + albedo_class);
            }
            classes += if threshold.is_some() { 2 } else { 1 };
        }
        self.albedos(GRAY, x)
    }
}

/// What tells that faces of a phantom which look different ways have different albedos, and not different light.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum AlbedoEvidence {
    /// Their colors. As long as the light is not known, it may as well be the light that makes a face brighter.
    Color,
    /// Their brightness, under light that explains everything else.
    Brightness,
}

/// Smallest distance between the mean normals of two groups of points that face different ways.
const MIN_NORMAL_DISTANCE: f32 = 0.5;
/// Smallest difference, between faces of different color, of a channel's logarithmic albedo less that of all channels.
const MIN_TINT_CONTRAST: f64 = 0.2;

fn face_different_ways(a: &[&Equation], b: &[&Equation]) -> bool {
    let mean =
        |points: &[&Equation]| points.iter().map(|e| e.point.normal_world).sum::<Vec3>() / points.len().max(1) as f32;
    mean(a).distance(mean(b)) > MIN_NORMAL_DISTANCE
}

/// Fewest points in view for a phantom to be used.
const MIN_POINTS: usize = 8;
/// Smallest distance between two albedos: as a difference of logarithms, and in units of the scatter of each group.
const MIN_CONTRAST: (f64, f64) = (0.08, 3.2);

/// Threshold between two groups of logarithmic albedos; `None` if there is only one group.
fn albedo_threshold(logs: &[f64]) -> Option<f64> {
    let mut sorted = logs.to_vec();
    sorted.sort_by(f64::total_cmp);
    // The tails are shadows and highlights, not albedos.
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
    // Otsu 1979: the threshold with the largest variance between the groups.
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
        (median, 1.48 * median_by(&mut sizes, f64::total_cmp).unwrap_or(0.0))
    };
    let (left, right) = core.split_at(best + 1);
    if left.is_empty() || right.is_empty() {
        return None;
    }
    let ((low, low_scatter), (high, high_scatter)) = (scatter(left), scatter(right));
    let gap = high - low;
    (gap > MIN_CONTRAST.0 && gap > MIN_CONTRAST.1 * 0.5 * (low_scatter + high_scatter)).then_some(0.5 * (low + high))
}
