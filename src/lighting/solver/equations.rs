//! Equations of the solver: the brightness of each point, and the light that reaches it per unknown.

use super::{
    bracketed_views::{BracketReading, read_bracketed_views},
    desk_frame::DeskFrame,
    light_transport::LightTransport,
    radiance_cells::RadianceCell,
    regions::{Region, profiles, shape_profile},
    sample_points::{SamplePoint, Surface, ink_places, sample_radiance},
    small_light::SmallLight,
};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Equation of one point. Index 3 of the arrays is the mean of the channels.
pub(super) struct Equation {
    pub point: SamplePoint,
    /// Index of the point in the light transport.
    pub point_index: usize,
    /// π · radiance; NaN where clipped.
    pub exitance: [f64; 4],
    /// Irradiance if clipped light is white.
    pub seen: [f64; 4],
    /// Irradiance per unit of extra gain of each region.
    pub per_gain: Vec<[f64; 4]>,
    /// The same for light whose gain is limited.
    pub limited: Vec<[f64; 4]>,
    /// Index of the unknown albedo.
    pub albedo_class: Option<usize>,
}

pub(super) struct Problem<'a> {
    pub transport: &'a LightTransport,
    pub sky: &'a [RadianceCell],
    pub regions: &'a [Region],
    /// Largest extra gain of limited light, per region.
    pub limits: Vec<[f64; 4]>,
    /// Pairs of adjacent regions; mostly parts of one window.
    pub neighbors: Vec<(usize, usize)>,
    pub equations: Vec<Equation>,
    /// Readings from darker views: extra gain per region and channel, or a lower bound of it.
    pub readings: Vec<GainReading>,
    /// Distribution of each region's extra light over its cells.
    pub profiles: Vec<Vec<f32>>,
    /// Positions of near lights, per region.
    pub positions: Vec<Option<Vec3>>,
    /// The small light that the last region stands for, if any.
    pub small_light: Option<SmallLight>,
}

/// Extra gain of a region according to a darker view, per channel.
pub(super) struct GainReading {
    pub region: usize,
    pub gain: [f64; 4],
    pub is_bound: [bool; 4],
}

/// Fewest places on a marker's ink whose color is trusted.
const MIN_INK_POINTS: usize = 8;
/// Index of gray, the mean of the channels.
pub(super) const GRAY: usize = 3;
/// Exponent of the default profile of a lamp's extra light: power of the distance to the edge of what is clipped. Lamps
/// and windows have bright centers and dim rims, and the brightest part of a soft box determines how flat its light
/// falls.
const PROFILE_POWER: f32 = 1.5;

impl<'a> Problem<'a> {
    pub(super) fn new(
        desk: &DeskFrame,
        transport: &'a LightTransport,
        sky: &'a [RadianceCell],
        regions: &'a [Region],
    ) -> Self {
        let readings = read_bracketed_views(desk, sky, regions);
        let mut profiles = profiles(sky, regions, PROFILE_POWER);
        for (reading, shape) in readings.iter().filter_map(|reading| Some((reading, reading.shape.as_ref()?))) {
            profiles[reading.region] = shape_profile(&regions[reading.region], sky, shape);
        }
        let seen_by_cell: Vec<Vec3> = sky.iter().map(|cell| cell.seen).collect();
        let clipped_by_cell = |(region, profile): (&Region, &Vec<f32>)| {
            let cells = region.cells.iter().zip(profile);
            let cells = cells.map(|(&i, weight)| (i, *weight * sky[i].clipped, *weight * sky[i].limited));
            cells.collect::<Vec<_>>()
        };
        let clipped_by_region: Vec<_> = regions.iter().zip(&profiles).map(clipped_by_cell).collect();
        let colors = phantom_colors(desk, transport, sky);
        let mut equations = Vec::with_capacity(transport.points.len());
        for (i, point) in transport.points.iter().enumerate() {
            let pos_camera = desk.camera_from_world.transform_point3(point.pos_world);
            let Some(radiance) =
                desk.intrinsics.project(pos_camera).and_then(|pixel| sample_radiance(&desk.frame, pixel))
            else {
                continue;
            };
            let weights = &transport.weights[i * sky.len()..(i + 1) * sky.len()];
            let mut seen = weighted_sum(weights, &seen_by_cell);
            let (mut per_gain, mut limited) = (Vec::with_capacity(regions.len()), Vec::with_capacity(regions.len()));
            for cells in &clipped_by_region {
                let mut sums = (Vec3::ZERO, Vec3::ZERO);
                for &(cell, free, limited) in cells {
                    sums.0 += weights[cell] * free;
                    sums.1 += weights[cell] * limited;
                }
                per_gain.push(with_gray(sums.0));
                limited.push(with_gray(sums.1));
            }
            for (phantom, solid_angle) in &transport.occluded[i] {
                seen += *solid_angle * colors[*phantom];
            }
            equations.push(Equation {
                point: *point,
                point_index: i,
                exitance: with_gray(PI * radiance),
                seen: with_gray(seen),
                per_gain,
                limited,
                albedo_class: None,
            });
        }
        unclip_paper(desk, &mut equations);
        let limits = regions.iter().map(|region| mean_limit(region, sky)).collect();
        let readings = gain_readings(readings, sky, regions);
        Self {
            transport,
            sky,
            regions,
            limits,
            neighbors: neighbors(regions),
            equations,
            readings,
            profiles,
            positions: vec![None; regions.len()],
            small_light: None,
        }
    }

    /// Index of the region that stands for a small light.
    pub(super) fn small_region(&self) -> Option<usize> {
        self.small_light.and(self.regions.len().checked_sub(1))
    }

    /// Whether a darker view reveals the brightness of a region.
    pub(super) fn is_read(&self, region: usize) -> bool {
        self.readings.iter().any(|reading| reading.region == region && !reading.is_bound[GRAY])
    }

    /// Irradiance with extra gains `x` on clipped light.
    pub(super) fn irradiance(&self, equation: &Equation, channel: usize, x: &[f64]) -> f64 {
        equation.seen[channel] + self.extra(equation, channel, x)
    }

    /// Irradiance added by the extra gains.
    pub(super) fn extra(&self, equation: &Equation, channel: usize, x: &[f64]) -> f64 {
        let parts = equation.per_gain.iter().zip(&equation.limited).zip(&self.limits).zip(x);
        parts.map(|(((free, limited), limit), x)| free[channel] * x + limited[channel] * x.min(limit[channel])).sum()
    }

    /// Mean irradiance of the paper.
    pub(super) fn open_irradiance(&self, channel: usize, x: &[f64]) -> f64 {
        let papers = self.equations.iter().filter(|e| e.point.surface == Surface::Paper);
        let (sum, count) = papers.fold((0.0, 0.0), |(s, n), e| (s + self.irradiance(e, channel, x), n + 1.0));
        f64::max(sum / f64::max(count, 1.0), 1e-6)
    }

    pub(super) fn paper_ratio(&self, channel: usize, x: &[f64]) -> f32 {
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
}

/// Completes channels in which the camera clips most of the paper, from the marker's ink: it is as gray as the paper.
fn unclip_paper(desk: &DeskFrame, equations: &mut [Equation]) {
    let radiance = |place: Vec3| {
        let pixel = desk.intrinsics.project(desk.camera_from_world.transform_point3(place))?;
        sample_radiance(&desk.frame, pixel)
    };
    let mut ink: Vec<Vec3> = desk.papers.iter().flat_map(ink_places).filter_map(radiance).collect();
    let mut paper: Vec<&mut Equation> = equations.iter_mut().filter(|e| e.point.surface == Surface::Paper).collect();
    let is_clipped: [bool; 3] =
        std::array::from_fn(|c| 2 * paper.iter().filter(|e| !e.exitance[c].is_finite()).count() > paper.len());
    if ink.len() < MIN_INK_POINTS || is_clipped == [false; 3] {
        return;
    }
    let ink: [f64; 3] = std::array::from_fn(|c| {
        let middle = ink.len() / 2;
        f64::from(ink.select_nth_unstable_by(middle, |a, b| a[c].total_cmp(&b[c])).1[c])
    });
    for equation in paper.iter_mut() {
        // Paper ÷ ink, from the channels that show both.
        let shown = (0..3).filter(|&c| !is_clipped[c] && equation.exitance[c].is_finite());
        let (sum, count) = shown.fold((0.0, 0.0), |(sum, n), c| (sum + equation.exitance[c] / ink[c], n + 1.0));
        if !(sum / count).is_finite() {
            continue;
        }
        for c in (0..3).filter(|&c| is_clipped[c]) {
            equation.exitance[c] = ink[c] * sum / count;
        }
        equation.exitance[GRAY] = equation.exitance[..3].iter().sum::<f64>() / 3.0;
    }
}

fn neighbors(regions: &[Region]) -> Vec<(usize, usize)> {
    let is_near = |a: &Region, b: &Region| a.dir_world.distance(b.dir_world) < 2.0 * (a.rms_radius + b.rms_radius);
    (0..regions.len())
        .flat_map(|r| (r + 1..regions.len()).map(move |s| (r, s)))
        .filter(|&(r, s)| is_near(&regions[r], &regions[s]))
        .collect()
}

fn mean_limit(region: &Region, sky: &[RadianceCell]) -> [f64; 4] {
    let (mut sum, mut total) = (Vec3::ZERO, Vec3::ZERO);
    for cell in region.cells.iter().map(|&i| &sky[i]) {
        sum += cell.solid_angle * cell.limited * (cell.limit - 1.0);
        total += cell.solid_angle * cell.limited;
    }
    let mean = |sum: f32, total: f32| if total > 0.0 { f64::from(sum / total) } else { 0.0 };
    let [r, g, b] = [0, 1, 2].map(|c| mean(sum[c], total[c]));
    [r, g, b, mean(sum.element_sum(), total.element_sum())]
}

/// Converts readings of darker views to extra gains.
fn gain_readings(readings: Vec<BracketReading>, sky: &[RadianceCell], regions: &[Region]) -> Vec<GainReading> {
    let in_gains = |reading: BracketReading| {
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

/// Half of the weights are zero, behind the surface. A plain loop, because it is the innermost one and has to be fast
/// in unoptimized builds too.
fn weighted_sum(weights: &[f32], values: &[Vec3]) -> Vec3 {
    let values = &values[..weights.len()];
    let (mut sum, mut i) = (Vec3::ZERO, 0);
    while i < weights.len() {
        if weights[i] > 0.0 {
            sum += weights[i] * values[i];
        }
        i += 1;
    }
    sum
}

pub(super) fn with_gray(v: Vec3) -> [f64; 4] {
    let v = v.as_dvec3();
    [v.x, v.y, v.z, v.element_sum() / 3.0]
}

/// Mean radiance of each phantom where the frame shows it; otherwise the mean radiance below the horizon.
fn phantom_colors(desk: &DeskFrame, transport: &LightTransport, sky: &[RadianceCell]) -> Vec<Vec3> {
    let up = desk.papers.first().map_or(Vec3::Y, |paper| paper.world_from_marker.transform_vector3(Vec3::Y));
    let (below, total) = sky
        .iter()
        .filter(|cell| cell.dir_world.dot(up) < 0.0)
        .fold((Vec3::ZERO, 0.0), |(sum, total), cell| (sum + cell.seen * cell.solid_angle, total + cell.solid_angle));
    let mut sums = vec![(Vec3::ZERO, 0.0_f32); desk.phantoms.len()];
    for point in &transport.points {
        let Surface::Phantom(k) = point.surface else {
            continue;
        };
        let pixel = desk.intrinsics.project(desk.camera_from_world.transform_point3(point.pos_world));
        if let Some(pixel) = pixel.filter(|p| p.cmpge(Vec2::ZERO).all() && p.cmplt(desk.frame.size.as_vec2()).all()) {
            sums[k].0 += desk.frame.linear(pixel.x as i32, pixel.y as i32);
            sums[k].1 += 1.0;
        }
    }
    sums.into_iter().map(|(sum, count)| if count > 0.0 { sum / count } else { below / f32::max(total, 1e-6) }).collect()
}
