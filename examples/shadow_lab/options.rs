//! The command line.

use crate::{
    method::{METHODS, Method},
    support::{Outcome, parse_size},
};
use bevy::math::UVec2;
use bevy_mirrorball::shadows::{DomeCoverage, ShadowDomeLight, ShadowFilter, VisibilitySamples};
use std::path::PathBuf;

/// Filters by their names on the command line.
pub(crate) const FILTERS: [(&str, ShadowFilter); 7] = [
    ("nearest", ShadowFilter::Nearest),
    ("bilinear", ShadowFilter::Bilinear),
    ("gauss", ShadowFilter::Gauss),
    ("pcf9", ShadowFilter::Pcf9),
    ("pcf25", ShadowFilter::Pcf25),
    ("pcf49", ShadowFilter::Pcf49),
    ("pcss", SOFT_FILTER),
];
pub(crate) const SOFT_FILTER: ShadowFilter = ShadowFilter::Pcss { angular_radius: 0.1 };
pub(crate) const SAMPLES: [(&str, VisibilitySamples); 4] = [
    ("interleaved", VisibilitySamples::Interleaved),
    ("half", VisibilitySamples::Half),
    ("full", VisibilitySamples::Full),
    ("fragment", VisibilitySamples::Fragment),
];
pub(crate) const COVERAGES: [(&str, DomeCoverage); 2] =
    [("hemisphere", DomeCoverage::Hemisphere), ("sphere", DomeCoverage::Sphere)];
pub(crate) const RESOLUTIONS: [(&str, u32); 5] = [("64", 64), ("128", 128), ("256", 256), ("512", 512), ("1024", 1024)];

/// With as many directions, the shadows that each of them throws on the walls do not show any more: compared with 1024
/// directions, the walls differ by at most 2/255, and with the default of 64 by 4/255.
const DIRECTIONS: u32 = 160;

pub(crate) struct Options {
    pub is_headless: bool,
    pub frames: u32,
    pub size: UVec2,
    pub out: PathBuf,
    pub method: Method,
    pub dome: ShadowDomeLight,
    /// Where the picture with all methods goes.
    pub gallery: Option<PathBuf>,
}

/// Returns the value with the given name on the command line.
fn named<T: Copy>(values: &[(&str, T)], option: &str, name: &str) -> Result<T, String> {
    let names: Vec<_> = values.iter().map(|(name, _)| *name).collect();
    let found = values.iter().find(|(known, _)| *known == name).map(|(_, value)| *value);
    found.ok_or(format!("--{option}: {name} is none of {}", names.join(", ")))
}

impl Options {
    pub(crate) fn from_command_line() -> Outcome<Self> {
        use lexopt::prelude::*;
        let mut options = Self {
            is_headless: false,
            frames: 4,
            size: UVec2::new(640, 360),
            out: PathBuf::from("shadow_lab"),
            method: Method::default(),
            dome: ShadowDomeLight { directions: DIRECTIONS, ..Default::default() },
            gallery: None,
        };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("headless") => options.is_headless = true,
                Long("frames") => options.frames = parser.value()?.parse()?,
                Long("size") => {
                    let text = parser.value()?.string()?;
                    options.size = parse_size(&text).ok_or("--size: write it like 640x360")?;
                }
                Long("out") => options.out = parser.value()?.into(),
                Long("method") => options.method = named(&METHODS, "method", &parser.value()?.string()?)?,
                Long("gallery") => options.gallery = Some(parser.value()?.into()),
                Long("directions") => options.dome.directions = parser.value()?.parse()?,
                Long("resolution") => options.dome.resolution = parser.value()?.parse()?,
                Long("refreshed") => options.dome.refreshed_per_frame = parser.value()?.parse()?,
                Long("key-lights") => options.dome.key_lights = parser.value()?.parse()?,
                Long("filter") => options.dome.filter = named(&FILTERS, "filter", &parser.value()?.string()?)?,
                Long("samples") => options.dome.samples = named(&SAMPLES, "samples", &parser.value()?.string()?)?,
                Long("coverage") => options.dome.coverage = named(&COVERAGES, "coverage", &parser.value()?.string()?)?,
                other => return Err(other.unexpected().into()),
            }
        }
        Ok(options)
    }
}
