//! Command line of the benchmark: what is measured, and against what.

use crate::support::Outcome;
use bevy::{math::UVec2, utils::default};
use bevy_mirrorball::shadows::{PlanarShadow, ShadowFilter, VisibilitySamples};
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

/// Filters of the dome by their names on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Filter {
    Nearest,
    Bilinear,
    Gauss,
    Pcf9,
    Pcf25,
    Pcf49,
    Pcss,
}

impl Filter {
    const ALL: [(&str, Self); 7] = [
        ("nearest", Self::Nearest),
        ("bilinear", Self::Bilinear),
        ("gauss", Self::Gauss),
        ("pcf9", Self::Pcf9),
        ("pcf25", Self::Pcf25),
        ("pcf49", Self::Pcf49),
        ("pcss", Self::Pcss),
    ];

    fn name(self) -> &'static str {
        Self::ALL.into_iter().find(|(_, filter)| *filter == self).map_or("", |(name, _)| name)
    }

    pub(crate) fn of_dome(self) -> ShadowFilter {
        match self {
            Self::Nearest => ShadowFilter::Nearest,
            Self::Bilinear => ShadowFilter::Bilinear,
            Self::Gauss => ShadowFilter::Gauss,
            Self::Pcf9 => ShadowFilter::Pcf9,
            Self::Pcf25 => ShadowFilter::Pcf25,
            Self::Pcf49 => ShadowFilter::Pcf49,
            Self::Pcss => ShadowFilter::Pcss { angular_radius: 0.1 },
        }
    }
}

impl FromStr for Filter {
    type Err = std::io::Error;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let named = Self::ALL.into_iter().find(|(known, _)| *known == name).map(|(_, filter)| filter);
        named.ok_or_else(|| {
            let names = Self::ALL.map(|(name, _)| name).join(", ");
            std::io::Error::other(format!("--filters: {name} is none of {names}"))
        })
    }
}

/// The source of the shadows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Method {
    None,
    /// `None` is the dome's own filter.
    Dome(u32, Samples, Option<Filter>),
    /// Planar shadows of one light with so many points, and of the rest of the light from so many directions.
    Planar(u32, u32),
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
            Self::Dome(directions, samples, _) => format!("dome_{directions}_{}", samples.name()),
            Self::Planar(..) => self.column(),
            Self::Directional(count) => format!("directional_{count}"),
            Self::Spot(count) => format!("spot_{count}"),
            Self::Ssao => "ssao".into(),
        }
    }

    /// Returns what the last column says of it, for the methods of this crate.
    pub(crate) fn column(self) -> String {
        match self {
            Self::Dome(_, _, None) => "dome".into(),
            Self::Dome(_, _, Some(filter)) => format!("dome_{}", filter.name()),
            Self::Planar(1, _) => "planar".into(),
            Self::Planar(_, 0) => "soft_planar".into(),
            Self::Planar(..) => "soft_planar_ambient".into(),
            peer => peer.name(),
        }
    }
}

pub(crate) struct Options {
    pub(crate) csv: Option<PathBuf>,
    pub(crate) cases: Vec<Case>,
    pub(crate) triangles: Vec<u32>,
    pub(crate) directions: Vec<u32>,
    pub(crate) samples: Vec<Samples>,
    /// Filters of the domes beside their own.
    filters: Vec<Filter>,
    /// Methods of this crate that are measured, by their names in the last column; all if empty.
    methods: Vec<String>,
    /// Numbers of things that cast.
    pub(crate) casters: Vec<u32>,
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
            filters: Vec::new(),
            methods: Vec::new(),
            casters: vec![20],
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
                Long("filters") => options.filters = list(&parser.value()?.string()?)?,
                Long("methods") => options.methods = list(&parser.value()?.string()?)?,
                Long("casters") => options.casters = list(&parser.value()?.string()?)?,
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

    /// Returns the methods of this crate that are to be measured.
    pub(crate) fn ours(&self) -> Vec<Method> {
        let filters = || std::iter::once(None).chain(self.filters.iter().copied().map(Some));
        let samples = || self.samples.iter().flat_map(|samples| filters().map(move |filter| (*samples, filter)));
        let domes = self
            .directions
            .iter()
            .flat_map(|directions| samples().map(|(samples, filter)| Method::Dome(*directions, samples, filter)));
        let PlanarShadow { samples, ambient, .. } = default();
        let planar = [Method::Planar(1, 0), Method::Planar(samples, 0), Method::Planar(samples, ambient)];
        let is_wanted = |method: &Method| self.methods.is_empty() || self.methods.contains(&method.column());
        domes.chain(planar).filter(is_wanted).collect()
    }
}

fn list<T: FromStr<Err: std::error::Error + 'static>>(text: &str) -> Outcome<Vec<T>> {
    Ok(text.split(',').map(str::parse).collect::<Result<_, _>>()?)
}
