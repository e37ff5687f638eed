//! Contrast of dots that is usual on a sheet in one frame, and the coverage of its fields by comparison with it.
//!
//! The readings of all fields enter; a coverage of 0…1 leaves for each, or `None` where the frame cannot tell. Shadow,
//! exposure and lamps scale dots and paper alike, so the relative difference of both stays. Glare and black level add
//! the same to both, so the absolute difference stays. A dot is there if either is as usual. What is usual is measured
//! in the frame itself: blur lowers it everywhere.

use super::sense::{DotKind, DotReading, FieldReading};

/// Fraction of the sheet's dots whose contrast is below the usual one. Several fields may be covered.
const USUAL: f32 = 0.8;
/// The same among the dots of one field.
const USUAL_IN_FIELD: f32 = 0.75;
/// Smallest contrast of a field, relative to the sheet's, that counts as its own usual one. With less, it is covered.
const MIN_FIELD_CONTRAST: f32 = 0.5;
/// Smallest usual contrast: below it, dots are lost in blur or glare.
const MIN_CONTRAST: f32 = 0.26;
/// Smallest usual difference between paper and dots, in units of the sensor's white: below it, noise is as strong.
const MIN_DIFFERENCE: f32 = 0.012;
/// Light from which the sensor may clip.
const CLIPPED: f32 = 0.93;
/// Light on a dot relative to the sheet's paper, above which it is a reflection: nothing that covers a dot is so much
/// brighter than paper.
const REFLECTION: f32 = 1.2;
/// Visibility up to which a dot counts as wholly covered, and from which as uncovered.
const COVERED_BELOW: f32 = 0.3;
const VISIBLE_FROM: f32 = 0.7;
/// Smallest fraction of a field, by weight, whose dots can be told.
const MIN_KNOWN: f32 = 0.6;
/// Number of steps in which contrasts are counted.
const BINS: usize = 128;

/// What is usual on a sheet in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SheetContrast {
    /// Contrast of each kind of dots, 0…1: the difference between paper and dot, divided by the paper's light.
    relative: [f32; DotKind::COUNT],
    /// Difference between paper and dot for each kind, in units of the sensor's white.
    absolute: [f32; DotKind::COUNT],
    /// Light on paper, in units of the sensor's white.
    paper: f32,
}

impl SheetContrast {
    /// Measures the contrast of all fields that the frame shows. Returns `None` if there are no dots to be seen: in the
    /// dark, in full overexposure, out of focus.
    pub(super) fn of<'a>(readings: impl Iterator<Item = &'a FieldReading>) -> Option<Self> {
        let mut relative: [Quantile; DotKind::COUNT] = Default::default();
        let mut absolute: [Quantile; DotKind::COUNT] = Default::default();
        let mut paper = Quantile::default();
        for dot in readings.flat_map(FieldReading::dots) {
            paper.count(dot.paper);
            if dot.dot <= CLIPPED {
                relative[dot.kind as usize].count(relative_contrast(dot));
                // The square root spreads small differences over more steps.
                absolute[dot.kind as usize].count((dot.paper - dot.dot).max(0.0).sqrt());
            }
        }
        // Grids of two columns or rows have not all kinds of dots.
        let usual = Self {
            relative: relative.map(|contrast| contrast.at(USUAL).unwrap_or(1.0)),
            absolute: absolute.map(|contrast| contrast.at(USUAL).unwrap_or(1.0).powi(2)),
            paper: paper.at(USUAL)?,
        };
        let can_tell = usual.relative() >= MIN_CONTRAST && usual.absolute.iter().all(|&light| light >= MIN_DIFFERENCE);
        can_tell.then_some(usual)
    }

    /// Contrast of the kind of dots that merges most with its neighbors, 0…1: a measure of sharpness and glare.
    fn relative(&self) -> f32 {
        self.relative.into_iter().fold(1.0, f32::min)
    }

    /// Fraction of a field that is covered, 0…1, by the weight of its dots. Returns `None` if too many of them are lost
    /// in glare.
    pub(super) fn coverage(&self, field: &FieldReading) -> Option<f32> {
        let relative = |dot: &DotReading| relative_contrast(dot) / self.relative[dot.kind as usize];
        // Glare, and blur where dots are smaller, lower the contrast of a field as a whole.
        let mut in_field = Quantile::default();
        for dot in field.dots().iter().filter(|dot| dot.dot <= CLIPPED) {
            in_field.count(0.5 * relative(dot));
        }
        let in_field = 2.0 * in_field.at(USUAL_IN_FIELD)?;
        let usual = if in_field >= MIN_FIELD_CONTRAST { in_field } else { 1.0 };

        let (mut covered, mut known, mut all) = (0.0, 0.0, 0.0);
        for dot in field.dots() {
            let weight = dot.kind.weight();
            all += weight;
            let absolute = (dot.paper - dot.dot) / self.absolute[dot.kind as usize];
            let visibility = (relative(dot) / usual).max(absolute);
            // Glare hides dots as well. Then the paper is clipped, or the dot is brighter than paper.
            if visibility < VISIBLE_FROM && (dot.paper > CLIPPED || dot.dot > REFLECTION * self.paper) {
                continue;
            }
            known += weight;
            covered += weight * ((VISIBLE_FROM - visibility) / (VISIBLE_FROM - COVERED_BELOW)).clamp(0.0, 1.0);
        }
        (known > 0.0 && known >= MIN_KNOWN * all).then(|| covered / known)
    }
}

/// Contrast of a dot with the paper around it, 0…1.
fn relative_contrast(dot: &DotReading) -> f32 {
    if dot.paper > 0.0 { ((dot.paper - dot.dot) / dot.paper).clamp(0.0, 1.0) } else { 0.0 }
}

/// Counts of values between 0 and 1, for their quantiles.
struct Quantile {
    bins: [u16; BINS],
    count: u32,
}

impl Default for Quantile {
    fn default() -> Self {
        Self { bins: [0; BINS], count: 0 }
    }
}

impl Quantile {
    fn count(&mut self, value: f32) {
        let bin = &mut self.bins[((value * BINS as f32) as usize).min(BINS - 1)];
        *bin = bin.saturating_add(1);
        self.count += 1;
    }

    /// Value below which a fraction of all values lies. `None` if there are no values.
    fn at(&self, fraction: f32) -> Option<f32> {
        let target = fraction * self.count as f32;
        let mut below = 0.0;
        for (i, &bin) in self.bins.iter().enumerate() {
            let bin = f32::from(bin);
            if bin > 0.0 && below + bin >= target {
                return Some((i as f32 + (target - below) / bin) / BINS as f32);
            }
            below += bin;
        }
        None
    }
}
