//! Command line of the benchmark: what is measured, and against what.

use crate::support::Outcome;
use bevy::math::UVec2;
use bevy_mirrorball::shadows::VisibilitySamples;
use std::{path::PathBuf, str::FromStr};

/// Number of directions that are redrawn in a frame in which casters move.
pub(crate) const REFRESHED: u32 = 16;

/// What changes from frame to frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Case {
    Static,
    /// The environment and the lights turn.
    Lights,
    /// Every caster turns.
    Moving,
    /// The camera moves.
    Camera,
}

impl Case {
    const ALL: [Self; 4] = [Self::Static, Self::Lights, Self::Moving, Self::Camera];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Lights => "lights",
            Self::Moving => "moving",
            Self::Camera => "camera",
        }
    }

    /// Returns the number of shadow maps that are redrawn per frame, key lights aside.
    pub(crate) fn refreshed(self) -> u32 {
        if self == Self::Moving { REFRESHED } else { 0 }
    }
}

impl FromStr for Case {
    type Err = std::io::Error;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let named = Self::ALL.into_iter().find(|case| case.name() == name);
        named.ok_or_else(|| std::io::Error::other(format!("--cases: {name} is none of static, lights, moving, camera")))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Samples {
    Interleaved,
    Half,
    Full,
}

impl Samples {
    const ALL: [Self; 3] = [Self::Interleaved, Self::Half, Self::Full];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Interleaved => "interleaved",
            Self::Half => "half",
            Self::Full => "full",
        }
    }

    pub(crate) fn of_dome(self) -> VisibilitySamples {
        match self {
            Self::Interleaved => VisibilitySamples::Interleaved,
            Self::Half => VisibilitySamples::Half,
            Self::Full => VisibilitySamples::Full,
        }
    }
}

impl FromStr for Samples {
    type Err = std::io::Error;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let named = Self::ALL.into_iter().find(|samples| samples.name() == name);
        named.ok_or_else(|| std::io::Error::other(format!("--samples: {name} is none of interleaved, half, full")))
    }
}

/// The source of the shadows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Method {
    None,
    Dome(u32, Samples),
    Directional(u32),
    Spot(u32),
    Ssao,
}

impl Method {
    const PEERS: [Self; 6] =
        [Self::None, Self::Directional(1), Self::Directional(2), Self::Directional(10), Self::Spot(64), Self::Ssao];

    pub(crate) fn name(self) -> String {
        match self {
            Self::None => "none".into(),
            Self::Dome(directions, samples) => format!("dome_{directions}_{}", samples.name()),
            Self::Directional(count) => format!("directional_{count}"),
            Self::Spot(count) => format!("spot_{count}"),
            Self::Ssao => "ssao".into(),
        }
    }
}

pub(crate) struct Options {
    pub(crate) csv: Option<PathBuf>,
    pub(crate) cases: Vec<Case>,
    pub(crate) triangles: Vec<u32>,
    pub(crate) directions: Vec<u32>,
    pub(crate) samples: Vec<Samples>,
    /// Slots for key lights in the dome, and the number of real lights that take them.
    pub(crate) key_lights: u32,
    pub(crate) real_lights: u32,
    /// Maximum number of surfels of the dome.
    pub(crate) surfels: u32,
    pub(crate) peers: Vec<Method>,
    pub(crate) size: UVec2,
    pub(crate) blocks: usize,
    /// Whether to print the time of each pass.
    pub(crate) passes: bool,
}

impl Options {
    pub(crate) fn from_command_line() -> Outcome<Self> {
        use lexopt::prelude::*;
        let mut options = Self {
            csv: None,
            cases: vec![Case::Static, Case::Lights, Case::Moving],
            triangles: vec![1_000, 20_000, 200_000],
            directions: vec![16, 64, 256],
            samples: vec![Samples::Interleaved, Samples::Half],
            key_lights: 2,
            real_lights: 0,
            surfels: 512,
            peers: Method::PEERS.to_vec(),
            size: UVec2::new(640, 360),
            blocks: 1,
            passes: false,
        };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("csv") => options.csv = Some(parser.value()?.into()),
                Long("cases") => options.cases = list(&parser.value()?.string()?)?,
                Long("triangles") => options.triangles = list(&parser.value()?.string()?)?,
                Long("directions") => options.directions = list(&parser.value()?.string()?)?,
                Long("samples") => options.samples = list(&parser.value()?.string()?)?,
                Long("key-lights") => options.key_lights = parser.value()?.parse()?,
                Long("real-lights") => options.real_lights = parser.value()?.parse()?,
                Long("surfels") => options.surfels = parser.value()?.parse()?,
                Long("passes") => options.passes = true,
                Long("peers") => {
                    let names = parser.value()?.string()?;
                    let wanted =
                        |peer: &Method| *peer == Method::None || names.split(',').any(|name| name == peer.name());
                    options.peers.retain(wanted);
                }
                Long("size") => {
                    let size = parser.value()?.string()?;
                    let (width, height) = size.split_once('x').ok_or("--size: write it as 640x360")?;
                    options.size = UVec2::new(width.parse()?, height.parse()?);
                }
                Long("blocks") => options.blocks = parser.value()?.parse::<usize>()?.max(1),
                // Cargo passes this to every benchmark.
                Long("bench") => (),
                other => return Err(other.unexpected().into()),
            }
        }
        Ok(options)
    }

    /// Returns the domes to measure.
    pub(crate) fn domes(&self) -> Vec<(u32, Samples)> {
        let with_samples = |directions: &u32| self.samples.iter().map(|samples| (*directions, *samples)).collect();
        self.directions.iter().flat_map::<Vec<_>, _>(with_samples).collect()
    }
}

fn list<T: FromStr<Err: std::error::Error + 'static>>(text: &str) -> Outcome<Vec<T>> {
    Ok(text.split(',').map(str::parse).collect::<Result<_, _>>()?)
}
