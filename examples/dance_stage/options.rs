//! The command line.

use crate::{
    stage::THINGS,
    support::{asset_path, parse_intrinsics, parse_size},
};
use bevy::math::{UVec2, Vec2};
use bevy_mirrorball::{
    camera::{Clip, IntrinsicsProblem},
    prelude::{CameraFeed, Intrinsics},
};
use lexopt::prelude::{Long, Short, ValueExt};
use std::path::PathBuf;

pub(crate) const USAGE: &str = "\
A dancer on a real desk, lit by the room that a mirrored ball shows.

usage: dance_stage [OPTIONS]

  --feed clip:DIR          a folder of pictures with a sidecar clip.json; repeated for ever
                           (default: the recorded desk in assets/desk_clip)
         image:FILE        one picture
         device:N          webcam number N (needs the feature `webcam`)
  --intrinsics FX,FY,CX,CY the camera's focal lengths and principal point in pixels of its pictures
  --calibration FILE       or what the example `calibrate` has measured, or YAML of OpenCV or ROS, with the distortion
  --fov DEG                or its horizontal field of view, if it was never calibrated
                           (default: what the clip's sidecar says, else 60)
  --set FILE               a glTF file whose node extras say where marker, ball and real things are; the stage stands on
                           the marker (default: assets/desk/set.glb for the recorded desk, else
                           assets/desk/bare_set.glb, which has nothing but marker and ball)
  --scene FILE             the same with virtual things of its own, instead of set and stage
  --toon THING[,THING…]    what starts as toon: dancer, floor, rim, left loudspeaker, right loudspeaker, mirror ball,
                           or all
  --headless               draw to files instead of a window; chosen by itself where there is no display
  --frames N               pictures to draw then (default 60)
  --size WIDTHxHEIGHT      their size in pixels (default: that of the feed's pictures)
  --out DIR                folder for them, frame_0000.png and so on, a contact sheet and report.json
                           (default dance_stage_out)

Keys: 1 to 9 switch one thing between toon and image-based, T all of them, Tab the panel, Space holds the dance,
Esc ends.";

/// Size requested from a webcam. Intrinsics refer to this size.
const DEVICE_SIZE: UVec2 = UVec2::new(640, 480);

/// Largest size of an image in pixels, which all graphics devices support.
const MAX_SIZE: u32 = 8192;

pub(crate) enum Feed {
    Clip(PathBuf),
    Image(PathBuf),
    Device(u32),
}

enum Lens {
    Intrinsics([f32; 4]),
    Calibration(Intrinsics),
    FieldOfView(f32),
}

pub(crate) struct Options {
    pub feed: Feed,
    lens: Option<Lens>,
    set: Option<PathBuf>,
    pub scene: Option<PathBuf>,
    /// Names of the objects that start as toon.
    pub toons: Vec<&'static str>,
    pub is_headless: bool,
    pub frames: u32,
    pub size: Option<UVec2>,
    pub out: PathBuf,
}

impl Options {
    /// `None` if help was asked for.
    pub(crate) fn from_command_line() -> Result<Option<Self>, lexopt::Error> {
        let mut parser = lexopt::Parser::from_env();
        let mut options = Self {
            feed: Feed::Clip(asset_path("desk_clip")),
            lens: None,
            set: None,
            scene: None,
            toons: Vec::new(),
            is_headless: false,
            frames: 60,
            size: None,
            out: "dance_stage_out".into(),
        };
        while let Some(argument) = parser.next()? {
            match argument {
                Long("feed") => options.feed = parser.value()?.parse_with(parse_feed)?,
                Long("intrinsics") => {
                    options.lens = Some(Lens::Intrinsics(parser.value()?.parse_with(parse_intrinsics)?));
                }
                Long("calibration") => {
                    options.lens = Some(Lens::Calibration(parser.value()?.parse_with(open_calibration)?));
                }
                Long("fov") => options.lens = Some(Lens::FieldOfView(parser.value()?.parse_with(parse_fov)?)),
                Long("set") => options.set = Some(parser.value()?.into()),
                Long("scene") => options.scene = Some(parser.value()?.into()),
                Long("toon") => options.toons = parser.value()?.parse_with(parse_toons)?,
                Long("headless") => options.is_headless = true,
                Long("frames") => options.frames = parser.value()?.parse_with(parse_frames)?,
                Long("size") => options.size = Some(parser.value()?.parse_with(parse_image_size)?),
                Long("out") => options.out = parser.value()?.into(),
                Long("help") | Short('h') => return Ok(None),
                other => return Err(other.unexpected()),
            }
        }
        if options.scene.is_some() && (options.set.is_some() || !options.toons.is_empty()) {
            return Err("--scene is shown without set and stage; leave out --set and --toon, or --scene".into());
        }
        Ok(Some(options))
    }

    /// The glTF file with the places of the real objects.
    pub(crate) fn scene_file(&self) -> PathBuf {
        let is_recorded_desk = matches!(&self.feed, Feed::Clip(folder) if *folder == asset_path("desk_clip"));
        let set = if is_recorded_desk { "desk/set.glb" } else { "desk/bare_set.glb" };
        self.scene.as_ref().or(self.set.as_ref()).cloned().unwrap_or_else(|| asset_path(set))
    }

    /// Returns the feed and the size of its frames. Checks that the feed exists and that a calibration is for its
    /// frames, but opens nothing that could take long.
    pub(crate) fn camera_feed(&self) -> Result<(CameraFeed, UVec2), Box<dyn std::error::Error>> {
        let (feed, size) = match &self.feed {
            Feed::Clip(folder) => (CameraFeed::clip(folder), Clip::open(folder)?.size),
            Feed::Image(path) => {
                let (width, height) = image::image_dimensions(path)
                    .map_err(|error| format!("cannot read the picture {}: {error}", path.display()))?;
                (CameraFeed::file(path), UVec2::new(width, height))
            }
            Feed::Device(index) => (device_feed(*index)?, DEVICE_SIZE),
        };
        if let Some(Lens::Calibration(lens)) = self.lens
            && let Some(problem @ IntrinsicsProblem::Shape { .. }) = lens.problem(size)
        {
            return Err(format!("--calibration: {problem}").into());
        }
        Ok((feed, size))
    }

    /// The intrinsics given on the command line, if any.
    pub(crate) fn intrinsics(&self, size: UVec2) -> Option<Intrinsics> {
        self.lens.as_ref().map(|lens| match *lens {
            Lens::Intrinsics([fx, fy, cx, cy]) => Intrinsics::new(Vec2::new(fx, fy), Vec2::new(cx, cy), size),
            Lens::Calibration(lens) => lens,
            Lens::FieldOfView(degrees) => Intrinsics::from_horizontal_fov(size, degrees.to_radians()),
        })
    }
}

#[cfg(feature = "webcam")]
fn device_feed(index: u32) -> Result<CameraFeed, &'static str> {
    Ok(CameraFeed::device(index))
}

#[cfg(not(feature = "webcam"))]
fn device_feed(_: u32) -> Result<CameraFeed, &'static str> {
    Err("this program was built without webcams; build it with `--features egui,webcam`")
}

fn parse_feed(text: &str) -> Result<Feed, String> {
    let expected = || format!("--feed takes clip:DIR, image:FILE or device:N, not {text}");
    match text.split_once(':').filter(|(_, what)| !what.is_empty()).ok_or_else(expected)? {
        ("clip", folder) => Ok(Feed::Clip(folder.into())),
        ("image", file) => Ok(Feed::Image(file.into())),
        ("device", number) => number.parse().map(Feed::Device).map_err(|_| expected()),
        _ => Err(expected()),
    }
}

fn open_calibration(path: &str) -> Result<Intrinsics, String> {
    Intrinsics::open(path).map_err(|error| error.to_string())
}

fn parse_fov(text: &str) -> Result<f32, String> {
    match text.parse() {
        Ok(degrees) if (1.0..=170.0).contains(&degrees) => Ok(degrees),
        _ => Err("--fov takes the horizontal field of view in degrees, 1 to 170".to_owned()),
    }
}

fn parse_toons(text: &str) -> Result<Vec<&'static str>, String> {
    if text == "all" {
        return Ok(THINGS.to_vec());
    }
    let find = |name: &str| THINGS.into_iter().find(|thing| *thing == name);
    let unknown = |name| format!("--toon takes all, or some of {}, with commas between, not {name}", THINGS.join(", "));
    text.split(',').map(|name| find(name.trim()).ok_or_else(|| unknown(name))).collect()
}

fn parse_frames(text: &str) -> Result<u32, String> {
    match text.parse() {
        Ok(frames) if frames > 0 => Ok(frames),
        _ => Err("--frames takes a whole number above 0".to_owned()),
    }
}

fn parse_image_size(text: &str) -> Result<UVec2, String> {
    parse_size(text)
        .filter(|size| size.max_element() <= MAX_SIZE)
        .ok_or_else(|| format!("--size takes WIDTHxHEIGHT in pixels, each 1 to {MAX_SIZE}, not {text}"))
}
