//! The command line.

use crate::support::parse_intrinsics;
use bevy::prelude::*;
use bevy_mirrorball::{prelude::Intrinsics, probe::ClipEvidence, shadows::PlanarShadow};
use lexopt::prelude::*;
use std::path::PathBuf;

pub(crate) const USAGE: &str = "\
Puts the virtual objects of a glTF scene into a photograph of a real desk.

usage: composite --frame PHOTO.png --intrinsics FX,FY,CX,CY --scene SCENE.glb --out OUT.png [options]

  --frame FILE              photograph with a printed tag36h11 marker and a mirrored ball (PNG or JPEG)
  --intrinsics FX,FY,CX,CY  focal lengths and principal point of the camera, in pixels of the photograph
  --calibration FILE        or what the example `calibrate` has measured, or YAML of OpenCV or ROS, with the distortion
  --scene FILE              glTF scene whose node extras name MarkerAnchor, LightProbeSphere, PhantomObject ...
  --out FILE                where the picture goes (PNG), same size as the photograph
  --report FILE             write pose, ball, gains and times as JSON
  --compare FILE            say in the report how far the result is from this picture of the same size
  --dump-environment FILE   write what lights the scene as an equirectangular picture (.hdr or .exr)
  --shadows METHOD          dome (default); planar: hard shadows of the strongest real lights, on the marker's plane
                            only; soft-planar: soft ones of all light, there; or none
  --no-shadows              the same as --shadows none
  --no-bounce               no light that virtual and real things send to each other
  --no-neighbors            mirrors show the room only, without virtual and real things
  --uniform-sky             light the scene by a uniform white sky instead of the room, for comparison
  --grain SEED              give virtual things the noise and the sharpness of the photograph; SEED is a whole number
  --evidence NAME           what tells how bright clipped lights are: desk (default), paper, or none to take them
                            for white
  --no-recovery             the same as --evidence none
";

enum Lens {
    Intrinsics([f32; 4]),
    Calibration(Intrinsics),
}

/// What casts shadows onto real things.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Shadows {
    Dome,
    /// With so many points on each light, and so many directions of the rest of the light.
    Planar {
        samples: u32,
        ambient: u32,
    },
    None,
}

pub(crate) struct Options {
    pub frame: PathBuf,
    lens: Lens,
    pub scene: PathBuf,
    pub out: PathBuf,
    pub report: Option<PathBuf>,
    pub compare: Option<PathBuf>,
    pub dump_environment: Option<PathBuf>,
    pub shadows: Shadows,
    pub has_bounces: bool,
    pub has_neighbors: bool,
    pub has_uniform_sky: bool,
    pub evidence: Option<ClipEvidence>,
    pub grain_seed: Option<u32>,
}

impl Options {
    pub(crate) fn intrinsics_of(&self, size: UVec2) -> Intrinsics {
        match self.lens {
            Lens::Intrinsics([fx, fy, cx, cy]) => Intrinsics::new(Vec2::new(fx, fy), Vec2::new(cx, cy), size),
            Lens::Calibration(lens) => lens,
        }
    }

    /// Reads the command line. Returns `None` if help was requested.
    pub(crate) fn from_command_line() -> Result<Option<Self>, String> {
        Self::parse(lexopt::Parser::from_env()).map_err(|error| format!("{error}\n\n{USAGE}"))
    }

    fn parse(mut parser: lexopt::Parser) -> Result<Option<Self>, lexopt::Error> {
        let (mut frame, mut lens, mut scene, mut out) = (None, None, None, None);
        let (mut report, mut compare, mut dump_environment) = (None, None, None);
        let (mut shadows, mut has_bounces, mut has_neighbors) = (Shadows::Dome, true, true);
        let (mut has_uniform_sky, mut evidence, mut grain_seed) = (false, Some(ClipEvidence::Desk), None);
        while let Some(argument) = parser.next()? {
            match argument {
                Long("frame") => frame = Some(PathBuf::from(parser.value()?)),
                Long("intrinsics") => {
                    lens = Some(Lens::Intrinsics(parser.value()?.parse_with(parse_intrinsics)?));
                }
                Long("calibration") => lens = Some(Lens::Calibration(parser.value()?.parse_with(open_calibration)?)),
                Long("scene") => scene = Some(PathBuf::from(parser.value()?)),
                Long("out") => out = Some(PathBuf::from(parser.value()?)),
                Long("report") => report = Some(PathBuf::from(parser.value()?)),
                Long("compare") => compare = Some(PathBuf::from(parser.value()?)),
                Long("dump-environment") => dump_environment = Some(PathBuf::from(parser.value()?)),
                Long("shadows") => shadows = parser.value()?.parse_with(shadows_named)?,
                Long("no-shadows") => shadows = Shadows::None,
                Long("no-bounce") => has_bounces = false,
                Long("no-neighbors") => has_neighbors = false,
                Long("uniform-sky") => has_uniform_sky = true,
                Long("no-recovery") => evidence = None,
                Long("evidence") => evidence = parser.value()?.parse_with(evidence_named)?,
                Long("grain") => grain_seed = Some(parser.value()?.parse()?),
                Long("help") | Short('h') => return Ok(None),
                other => return Err(other.unexpected()),
            }
        }
        Ok(Some(Self {
            frame: frame.ok_or("--frame is missing")?,
            lens: lens.ok_or(
                "--intrinsics is missing; calibrate the camera (--calibration FILE) or give FX,FY,CX,CY in pixels",
            )?,
            scene: scene.ok_or("--scene is missing")?,
            out: out.ok_or("--out is missing")?,
            report,
            compare,
            dump_environment,
            shadows,
            has_bounces,
            has_neighbors,
            has_uniform_sky,
            evidence,
            grain_seed,
        }))
    }
}

fn open_calibration(path: &str) -> Result<Intrinsics, String> {
    Intrinsics::open(path).map_err(|error| error.to_string())
}

fn shadows_named(name: &str) -> Result<Shadows, &'static str> {
    match name {
        "dome" => Ok(Shadows::Dome),
        "planar" => Ok(Shadows::Planar { samples: 1, ambient: 0 }),
        "soft-planar" => Ok(Shadows::Planar { samples: PlanarShadow::default().samples, ambient: 64 }),
        "none" => Ok(Shadows::None),
        _ => Err("give dome, planar, soft-planar or none"),
    }
}

fn evidence_named(name: &str) -> Result<Option<ClipEvidence>, &'static str> {
    match name {
        "desk" => Ok(Some(ClipEvidence::Desk)),
        "paper" => Ok(Some(ClipEvidence::Paper)),
        "none" => Ok(None),
        _ => Err("give desk, paper or none"),
    }
}
