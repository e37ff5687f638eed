//! The command line.

use crate::{
    game::Choice,
    places::Place,
    platform,
    song::Difficulty,
    stage::THINGS,
    support::{Outcome, asset_path, parse_intrinsics, parse_size},
};
use bevy::math::{UVec2, Vec2};
use bevy_mirrorball::{
    camera::IntrinsicsProblem,
    prelude::{CameraFeed, Intrinsics},
};
use lexopt::prelude::{Long, Short, ValueExt};
use std::path::PathBuf;

/// Size requested from a webcam. Intrinsics refer to this size.
pub(crate) const DEVICE_SIZE: UVec2 = UVec2::new(640, 480);

/// Largest size of an image in pixels, which all graphics devices support.
const MAX_SIZE: u32 = 8192;

/// Where the frames come from.
pub(crate) enum Feed {
    Clip(PathBuf),
    Image(PathBuf),
    Device(u32),
}

/// What is danced to.
pub(crate) enum SongFile {
    /// A StepMania file.
    Steps(PathBuf),
    /// Music, to which arrows are set.
    Music(PathBuf),
}

enum Lens {
    Intrinsics([f32; 4]),
    Calibration(Intrinsics),
    FieldOfView(f32),
}

pub(crate) struct Options {
    feed: Option<Feed>,
    /// Where the dancer is if there is no camera.
    pub place: Option<Place>,
    lens: Option<Lens>,
    set: Option<PathBuf>,
    pub scene: Option<PathBuf>,
    /// Width of the printed mat in meters.
    pub mat: Option<f32>,
    /// Whether there are markers on the shoes.
    pub has_shoes: bool,
    /// Names of the objects that start as toon.
    pub toons: Vec<&'static str>,
    pub song: SongFile,
    /// StepMania file to write.
    pub save_song: Option<PathBuf>,
    difficulty: Option<Difficulty>,
    players: Option<usize>,
    /// Whether the players dance by themselves.
    pub is_demo: bool,
    /// Seed of chance: of what a demo does, and of the arrows that are set to music.
    pub seed: u64,
    /// The glTF file of the dancer.
    pub dancer: PathBuf,
    pub is_headless: bool,
    pub result: Option<PathBuf>,
    pub frames: u32,
    pub size: Option<UVec2>,
    pub out: PathBuf,
}

impl Options {
    /// `None` if help was asked for.
    pub(crate) fn parse(mut parser: lexopt::Parser) -> Result<Option<Self>, lexopt::Error> {
        let mut options = Self {
            feed: None,
            place: None,
            lens: None,
            set: None,
            scene: None,
            mat: None,
            has_shoes: false,
            toons: Vec::new(),
            song: SongFile::Steps(asset_path("music/vibe_ace.sm")),
            save_song: None,
            difficulty: None,
            players: None,
            is_demo: false,
            seed: 1,
            dancer: asset_path("models/dancer.glb"),
            is_headless: false,
            result: None,
            frames: 60,
            size: None,
            out: "dance_stage_out".into(),
        };
        while let Some(argument) = parser.next()? {
            match argument {
                Long("feed") => options.feed = Some(parser.value()?.parse_with(parse_feed)?),
                Long("intrinsics") => {
                    options.lens = Some(Lens::Intrinsics(parser.value()?.parse_with(parse_intrinsics)?));
                }
                Long("calibration") => {
                    options.lens = Some(Lens::Calibration(parser.value()?.parse_with(open_calibration)?));
                }
                Long("fov") => options.lens = Some(Lens::FieldOfView(parser.value()?.parse_with(parse_fov)?)),
                Long("set") => options.set = Some(parser.value()?.into()),
                Long("scene") => options.scene = Some(parser.value()?.into()),
                Long("mat") => options.mat = Some(parser.value()?.parse_with(parse_mat)?),
                Long("shoes") => options.has_shoes = true,
                Long("toon") => options.toons = parser.value()?.parse_with(parse_toons)?,
                Long("solo") => options.place = options.place.or(Some(Place::Stonehenge)),
                Long("place") => options.place = Some(parser.value()?.parse_with(parse_place)?),
                Long("song") => options.song = SongFile::Steps(parser.value()?.into()),
                Long("music") => options.song = SongFile::Music(parser.value()?.into()),
                Long("save-song") => options.save_song = Some(parser.value()?.into()),
                Long("difficulty") => options.difficulty = Some(parser.value()?.parse_with(parse_difficulty)?),
                Long("players") => options.players = Some(parser.value()?.parse_with(parse_players)?),
                Long("dancer") => options.dancer = parser.value()?.into(),
                Long("demo") => options.is_demo = true,
                Long("seed") => options.seed = parser.value()?.parse()?,
                Long("result") => options.result = Some(parser.value()?.into()),
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
        options.refuse_camera_of_solo()?;
        if options.has_shoes && options.mat.is_none() {
            return Err("--shoes step on a mat; add --mat WIDTH, or leave it out".into());
        }
        if options.result.is_some() && !(options.is_headless && options.is_demo) {
            return Err(
                "--result is what a demo without a window reaches; add --headless --demo, or leave it out".into()
            );
        }
        Ok(Some(options))
    }

    /// Without a feed, a place has neither marker nor room.
    fn refuse_camera_of_solo(&self) -> Result<(), lexopt::Error> {
        if self.place.is_some() && self.scene.is_some() {
            return Err("--scene is shown instead of a place; leave out --scene, or --solo and --place".into());
        }
        let of_camera = [
            ("--intrinsics, --calibration and --fov", self.lens.is_some()),
            ("--set", self.set.is_some()),
            ("--mat", self.mat.is_some()),
        ];
        match of_camera.into_iter().find(|(_, is_given)| *is_given && self.place.is_some() && !self.has_room()) {
            Some((option, _)) => Err(format!(
                "--solo and --place are without a camera unless --feed names one; leave out {option}, or add --feed"
            )
            .into()),
            None => Ok(()),
        }
    }

    /// Whether there is a place that is lit by the room of a feed.
    pub(crate) fn has_room(&self) -> bool {
        self.place.is_some() && self.feed.is_some()
    }

    /// The next dance: what the command line says, and the rest as it is chosen usually.
    pub(crate) fn choice(&self, usual: Choice) -> Choice {
        let difficulty = self.difficulty.unwrap_or(usual.difficulty);
        let players = self.players.unwrap_or(usual.players);
        Choice { difficulty, players, is_demo: self.is_demo, seed: self.seed, ..usual }
    }

    /// The glTF file that is shown: that of the place, or of the desk.
    pub(crate) fn scene_file(&self) -> PathBuf {
        self.place.map_or_else(|| self.desk_file(), Place::file)
    }

    /// The glTF file with the places of the real objects.
    pub(crate) fn desk_file(&self) -> PathBuf {
        let is_recorded_desk = match &self.feed {
            None => true,
            Some(Feed::Clip(folder)) => *folder == asset_path("desk_clip"),
            Some(_) => false,
        };
        let set = if is_recorded_desk { "desk/set.glb" } else { "desk/bare_set.glb" };
        self.scene.as_ref().or(self.set.as_ref()).cloned().unwrap_or_else(|| asset_path(set))
    }

    /// Whether a camera is asked for.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn has_device(&self) -> bool {
        matches!(self.feed, Some(Feed::Device(_)))
    }

    /// Returns the feed and the size of its frames. Checks that the feed exists and that a calibration is for its
    /// frames, but opens nothing that could take long.
    pub(crate) fn camera_feed(&self) -> Outcome<(CameraFeed, UVec2)> {
        let recorded_desk = Feed::Clip(asset_path("desk_clip"));
        let (feed, size) = platform::open_feed(self.feed.as_ref().unwrap_or(&recorded_desk))?;
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

fn parse_mat(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(millimeters) if (100.0..=5000.0).contains(&millimeters) => Ok(0.001 * millimeters),
        _ => Err(format!("--mat takes the width of the printed mat in millimeters, 100 to 5000, not {text}")),
    }
}

fn parse_toons(text: &str) -> Result<Vec<&'static str>, String> {
    let things = [&THINGS[..], &Place::ALL.map(Place::name)].concat();
    if text == "all" {
        return Ok(things);
    }
    let find = |name: &str| things.iter().copied().find(|thing| *thing == name);
    let unknown = |name| format!("--toon takes all, or some of {}, with commas between, not {name}", things.join(", "));
    text.split(',').map(|name| find(name.trim()).ok_or_else(|| unknown(name))).collect()
}

fn parse_place(text: &str) -> Result<Place, String> {
    let find = Place::ALL.into_iter().find(|place| place.name() == text);
    find.ok_or_else(|| format!("--place takes {}, not {text}", Place::ALL.map(Place::name).join(" or ")))
}

fn parse_difficulty(text: &str) -> Result<Difficulty, String> {
    let find = Difficulty::ALL.into_iter().find(|difficulty| difficulty.name().eq_ignore_ascii_case(text));
    find.ok_or_else(|| format!("--difficulty takes easy, medium or hard, not {text}"))
}

fn parse_players(text: &str) -> Result<usize, String> {
    match text {
        "1" => Ok(1),
        "2" => Ok(2),
        _ => Err(format!("--players takes 1 or 2, not {text}")),
    }
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
