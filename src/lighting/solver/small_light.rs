//! Search for a small light inside the clipped part of the sky, such as the sun in bright clouds.
//!
//! The ball shows sun and clouds alike. Only the edges of the shadows on the desk tell where in what is clipped the sun
//! is, and that there is one.

use super::{
    desk_frame::{DeskFrame, DeskGeometry, MirrorBall},
    equations::{GRAY, Problem, with_gray},
    light_transport::parallel_weight,
    radiance_cells::{CELLS_PER_EDGE, RadianceCell},
    regions::{Region, neighbors_of},
    robust_fit::GrayFit,
    shadow_edges::{EdgeEvidence, ShadowEdges},
};
use glam::Vec3;
use std::f32::consts::FRAC_2_PI;

/// A small, distant light inside the clipped part of the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SmallLight {
    /// Unit vector, world space.
    pub dir_world: Vec3,
    /// Half of the angle that it subtends, radians.
    pub angular_radius: f32,
    /// Fraction of the light on the desk that is missing in its shadow, as the edges show it, 0…1.
    pub fraction: f32,
    /// Clipped cell of the sky that stands for it.
    pub cell: usize,
}

/// Points of the outlines that are tried per direction: in the first search, and when a direction is refined.
const SEARCH_POINTS: usize = 150;
const REFINE_POINTS: usize = 400;
/// Number of the best directions of the first search that are refined, and the smallest angle between them, radians.
const REFINED: usize = 4;
const START_DISTANCE: f32 = 0.1;
/// Steps by which a direction is refined, radians.
const REFINE_STEPS: [f32; 5] = [0.024, 0.012, 0.006, 0.003, 0.0015];
/// Smallest angle above the horizon, as its sine.
const MIN_HEIGHT: f32 = 0.1;
/// Fewest places at which edges of shadows are compared.
const MIN_EDGES: usize = 30;
/// Smallest step at the edges of shadows, as a logarithm.
const MIN_STEP: f32 = 0.05;
/// Smallest step in units of its standard error.
const MIN_SIGNIFICANCE: f32 = 8.0;
/// Smallest step in units of the scatter between the directions of the search, in most of which there is no light.
const MIN_OVER_SCATTER: f32 = 4.0;
/// Smallest step close to the edge, relative to that farther away. Below it, the edges are those of a wide light.
const MIN_SHARPNESS: f32 = 0.7;
/// Sharpness from which on edges are as sharp as pixels can show.
const SHARP: f32 = 0.8;
/// Angular radius of the sun, radians.
const SUN_RADIUS: f32 = 0.0047;
/// Smallest clipped radiance of the cell that stands for the light, in its darkest channel.
const MIN_CLIPPED: f32 = 0.3;

/// What the search compares.
fn score(evidence: &EdgeEvidence) -> f32 {
    if evidence.count < MIN_EDGES { f32::NEG_INFINITY } else { evidence.narrow + evidence.wide }
}

/// Finds the small light whose shadows have the clearest edges. `known` is the direction in the frame before.
pub(super) fn find_small_light(
    edges: &ShadowEdges,
    sky: &[RadianceCell],
    regions: &[Region],
    up_world: Vec3,
    known: Option<Vec3>,
) -> Option<SmallLight> {
    let accepted = |dir: Vec3, scatter: f32| {
        let (dir, evidence) = refine(edges, dir);
        let is_significant = evidence.narrow > MIN_STEP
            && evidence.narrow > MIN_SIGNIFICANCE * evidence.error
            && evidence.narrow > MIN_OVER_SCATTER * scatter
            && evidence.narrow > MIN_SHARPNESS * evidence.wide;
        is_significant.then_some((dir, evidence))
    };
    let found = known.and_then(|dir| accepted(dir, 0.0)).or_else(|| {
        // Every second cell, as on a checkerboard: the edges of shadows are looked for in a width of more than 4°.
        let is_tried = |i: &&usize| (*i + *i / CELLS_PER_EDGE as usize).is_multiple_of(2);
        let cells = regions.iter().flat_map(|region| &region.cells).filter(is_tried);
        let mut tried: Vec<(f32, Vec3)> = cells
            .map(|&i| sky[i].dir_world)
            .filter(|dir| dir.dot(up_world) > MIN_HEIGHT)
            .map(|dir| (score(&edges.evidence(dir, SEARCH_POINTS)), dir))
            .filter(|(score, _)| score.is_finite())
            .collect();
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        let scatter = scatter(&tried);
        let mut starts: Vec<Vec3> = Vec::new();
        for (_, dir) in tried {
            if starts.len() < REFINED && starts.iter().all(|start| start.angle_between(dir) > START_DISTANCE) {
                starts.push(dir);
            }
        }
        let best = starts.into_iter().filter_map(|dir| accepted(dir, scatter));
        best.max_by(|a, b| score(&a.1).total_cmp(&score(&b.1)))
    });
    let (dir_world, evidence) = found?;
    let cell = brightest_cell(dir_world, sky, regions)?;
    let fraction = 1.0 - (-evidence.narrow).exp();
    Some(SmallLight { dir_world, angular_radius: angular_radius(&evidence), fraction, cell })
}

/// Angular radius of a light, from the sharpness of the edges of its shadows.
///
/// Of the step at the edge of the shadow of a disk, a band of ± x radii of the penumbra holds
/// (x √(1 − x²) + asin x) · 2 ÷ π. Edges that are as sharp as the frame's pixels are those of the sun.
fn angular_radius(evidence: &EdgeEvidence) -> f32 {
    let fraction = evidence.narrow / (SHARP * evidence.wide);
    let in_band = |x: f32| (x * (1.0 - x * x).sqrt() + x.asin()) * FRAC_2_PI;
    let (mut low, mut high) = (0.01_f32, 1.0_f32);
    for _ in 0..16 {
        let middle = 0.5 * (low + high);
        if in_band(middle) < fraction { low = middle } else { high = middle }
    }
    let radius = evidence.resolution * (1.0 / (high * high) - 1.0).max(0.0).sqrt();
    radius.max(SUN_RADIUS)
}

/// Half of the median size of the scores, which are sums of two steps.
fn scatter(tried: &[(f32, Vec3)]) -> f32 {
    let mut sizes: Vec<f32> = tried.iter().map(|(score, _)| score.abs()).collect();
    crate::median::median_by(&mut sizes, f32::total_cmp).unwrap_or(0.0) / 2.0
}

/// Climbs to the direction with the clearest edges near a given one.
fn refine(edges: &ShadowEdges, start: Vec3) -> (Vec3, EdgeEvidence) {
    let mut best = (start, edges.evidence(start, REFINE_POINTS));
    for step in REFINE_STEPS {
        for _ in 0..3 {
            let (right, up) = best.0.any_orthonormal_pair();
            let around = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
            let tried = around.map(|(x, y)| {
                let dir = (best.0 + step * (x * right + y * up)).normalize();
                (dir, edges.evidence(dir, REFINE_POINTS))
            });
            let clearest = tried.into_iter().max_by(|a, b| score(&a.1).total_cmp(&score(&b.1)));
            match clearest.filter(|(_, evidence)| score(evidence) > score(&best.1)) {
                Some(better) => best = better,
                None => break,
            }
        }
    }
    best
}

/// The cell at a direction or beside it with the most clipped light, which can hold all of a light's brightness.
fn brightest_cell(dir: Vec3, sky: &[RadianceCell], regions: &[Region]) -> Option<usize> {
    let clipped = |i: usize| sky[i].clipped.min_element();
    let distance = |i: usize| sky[i].dir_world.distance_squared(dir);
    let cells = regions.iter().flat_map(|region| region.cells.iter().copied());
    let nearest = cells.min_by(|&a, &b| distance(a).total_cmp(&distance(b)))?;
    let is_beside = distance(nearest) < 2.0 * sky[nearest].solid_angle;
    let around = std::iter::once(nearest).chain(neighbors_of(nearest).iter().copied());
    let brightest = around.max_by(|&a, &b| clipped(a).total_cmp(&clipped(b)))?;
    let best = if clipped(nearest) >= MIN_CLIPPED { nearest } else { brightest };
    (is_beside && clipped(best) >= MIN_CLIPPED).then_some(best)
}

/// The search for a small light, from frame to frame.
#[derive(Clone, Debug, Default)]
pub(super) struct SmallLightSearch {
    /// Direction of the light in the frame before.
    found: Option<Vec3>,
    /// Frames until the whole sky is searched again.
    rest: u32,
}

/// Frames between searches of the whole sky that find nothing.
const SEARCH_PERIOD: u32 = 16;

/// A small light that the edges of shadows suggest.
pub(super) struct Candidate {
    pub light: SmallLight,
    /// Whether there was one in the frame before.
    pub is_known: bool,
}

impl SmallLightSearch {
    /// Looks for a small light in a frame. The whole sky is searched in the first frame and every few frames.
    pub(super) fn candidate(
        &mut self,
        desk: &DeskFrame,
        geometry: DeskGeometry,
        sky: &[RadianceCell],
        regions: &[Region],
        up_world: Vec3,
    ) -> Option<Candidate> {
        // Darker views show the light itself.
        let is_darker = |ball: &MirrorBall| ball.reflectance < 0.5 * desk.ball.reflectance;
        let has_darker_views = !desk.bracketed_exposures.is_empty() || desk.other_balls.iter().any(is_darker);
        if has_darker_views || regions.is_empty() {
            self.found = None;
            return None;
        }
        if self.found.is_none() && self.rest > 0 {
            self.rest -= 1;
            return None;
        }
        // A light that is lost is looked for once more in the next frame.
        self.rest = if self.found.is_some() { 0 } else { SEARCH_PERIOD };
        let edges = ShadowEdges::new(desk, geometry);
        let light = find_small_light(&edges, sky, regions, up_world, self.found);
        let is_known = self.found.zip(light).is_some_and(|(dir, light)| dir.angle_between(light.dir_world) < MAX_TURN);
        self.found = light.filter(|_| is_known).map(|light| light.dir_world);
        light.map(|light| Candidate { light, is_known })
    }

    /// Notes whether a new candidate is a light, and returns it.
    pub(super) fn decide(&mut self, light: SmallLight, is_light: bool) -> bool {
        self.found = is_light.then_some(light.dir_world);
        is_light
    }
}

/// Largest angle by which a small light turns from frame to frame, radians.
const MAX_TURN: f32 = 0.1;

impl SmallLight {
    /// The regions with that of the light behind them, which takes its cell.
    pub(super) fn split_off(&self, regions: &[Region], sky: &[RadianceCell]) -> Vec<Region> {
        let weight = |i: usize| sky[i].solid_angle;
        let mut regions: Vec<Region> = regions
            .iter()
            .filter_map(|region| {
                if !region.cells.contains(&self.cell) {
                    return Some(region.clone());
                }
                let cells: Vec<usize> = region.cells.iter().copied().filter(|i| *i != self.cell).collect();
                (!cells.is_empty()).then(|| Region::new(cells, sky, &weight))
            })
            .collect();
        regions.push(Region { dir_world: self.dir_world, ..Region::new(vec![self.cell], sky, &weight) });
        regions
    }
}

impl Problem<'_> {
    /// Fits the mean of the channels again from a start in which the small light is as strong as the edges show, if
    /// that fits better. Otherwise its shadows, which are few points, may be taken for outliers.
    pub(super) fn fit_small_light(&mut self, cold: GrayFit) -> GrayFit {
        let (Some(light), Some(region)) = (self.small_light, self.small_region()) else {
            return cold;
        };
        let per_gain = self.mean_per_gain(region);
        if per_gain <= 0.0 {
            return cold;
        }
        let fraction = f64::from(light.fraction);
        let mut start: Vec<f64> = cold.x.iter().map(|x| (1.0 - fraction) * x).collect();
        start[region] = fraction * self.open_irradiance(GRAY, &cold.x) / per_gain;
        let warm = self.fit_gray(Some(&start));
        // The albedo classes stored in the problem are those of the last fit.
        if warm.cost <= cold.cost { warm } else { self.fit_gray(Some(&cold.x)) }
    }

    /// Replaces the light of the last region by that of a small light, whose shadows are sharp.
    pub(super) fn set_small_light(&mut self, light: SmallLight, geometry: DeskGeometry) {
        let region = self.regions.len() - 1;
        let cell = self.sky[light.cell];
        for equation in &mut self.equations {
            let reflections = &self.transport.reflections[equation.point_index];
            let weight = parallel_weight(geometry, &equation.point, reflections, &cell, light.dir_world);
            equation.per_gain[region] = with_gray(weight * cell.clipped);
            equation.limited[region] = [0.0; 4];
        }
        self.neighbors.retain(|&(a, b)| a != region && b != region);
        self.small_light = Some(light);
    }
}
