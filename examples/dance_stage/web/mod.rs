//! The stage in the page of a browser: `index.html` beside this file, served by `scripts/web.sh`.
//!
//! The page's address has the options of the command line, as `?toon=all&demo`, and what is shown is told to the page
//! (see [`report`]). Presses of its buttons come as keys. With `?frame=N` the picture is the one that `--headless`
//! writes as frame N, and then stands still.

mod pipelines;
mod report;
mod still;
mod turned;

use crate::{
    Outcome,
    game::Song,
    options::{DEVICE_SIZE, Feed, Options},
    song::Simfile,
    usage::USAGE,
    window,
};
use bevy::{asset::AssetMetaCheck, prelude::*};
use bevy_mirrorball::{prefilter::EnvironmentState, prelude::*};
use std::{path::Path, process::ExitCode};
use still::Still;

/// The clip that is played without a camera.
const CLIP: &str = "desk_clip/clip.json";

/// What the page's address has beyond the command line: the frame to show, and what the page itself remembers.
const NOT_OF_STAGE: [&str; 2] = ["frame", "device"];

/// Runs the stage with the options of the page.
pub(crate) fn main() -> ExitCode {
    let arguments = arguments(&query());
    let frame = arguments.iter().find_map(|(name, value)| (name == "frame").then(|| value.parse().ok())?);
    let options = Options::parse(lexopt::Parser::from_args(flags(&arguments))).map_err(Into::into);
    let outcome = options.and_then(|options| match options {
        Some(options) => run(&options, frame),
        None => Err(USAGE.into()),
    });
    if let Err(error) = outcome {
        report::tell("stage", "failed");
        report::tell("reason", &error.to_string());
    }
    ExitCode::SUCCESS
}

fn run(options: &Options, frame: Option<u32>) -> Outcome<()> {
    report::tell("stage", "loading");
    window::run(options, |app| {
        app.add_systems(Last, report::report);
        if options.has_device() {
            app.add_systems(Update, turned::turn_with_phone);
        } else {
            app.add_systems(Startup, start_clip);
        }
        match frame {
            Some(frame) => {
                pipelines::watch(app);
                app.insert_resource(Still::new(frame)).add_systems(Last, still::advance.before(report::report));
            }
            None => window::fade_styles(app),
        }
    })
}

/// The part of the address after `?`.
fn query() -> String {
    let window = web_sys::window();
    window.and_then(|window| window.location().search().ok()).unwrap_or_default()
}

/// Names and values in the query of an address.
fn arguments(query: &str) -> Vec<(String, String)> {
    let decode = |text: &str| {
        let spaced = text.replace('+', " ");
        js_sys::decode_uri_component(&spaced).map_or(spaced, String::from)
    };
    let pairs = query.trim_start_matches('?').split('&').filter(|pair| !pair.is_empty());
    pairs
        .map(|pair| pair.split_once('=').unwrap_or((pair, "")))
        .map(|(name, value)| (decode(name), decode(value)))
        .collect()
}

/// The same as on a command line.
fn flags(arguments: &[(String, String)]) -> Vec<String> {
    let of_stage = arguments.iter().filter(|(name, _)| !NOT_OF_STAGE.contains(&name.as_str()));
    let flags = of_stage.flat_map(|(name, value)| [format!("--{name}"), value.clone()]);
    flags.filter(|flag| !flag.is_empty()).collect()
}

/// Plays the recorded desk.
fn start_clip(
    mut commands: Commands,
    assets: Res<AssetServer>,
    cameras: Query<Entity, With<ArCamera>>,
    still: Option<Res<Still>>,
) {
    let feed = if still.is_some() { still::feed(&assets) } else { CameraFeed::clip_asset(assets.load(CLIP)) };
    for camera in &cameras {
        commands.entity(camera).insert(feed.clone());
    }
}

fn is_lit(state: &EnvironmentState) -> bool {
    matches!(state, EnvironmentState::Live { refreshes: 1.., .. })
}

/// Returns a feed and the size of its frames. The clip is an asset, which comes when there are assets.
pub(crate) fn open_feed(feed: &Feed) -> Outcome<(CameraFeed, UVec2)> {
    match feed {
        Feed::Clip(_) => Ok((CameraFeed::default(), DEVICE_SIZE)),
        // The browser lets the user choose.
        Feed::Device(_) => Ok((CameraFeed::browser(BrowserCameraOptions::default()), DEVICE_SIZE)),
        Feed::Image(_) => Err("a page has no files; leave out feed, or give device:0".into()),
    }
}

/// The song that comes with the game: a page has no files of its own.
pub(crate) fn open_song(_: &Options) -> Outcome<Song> {
    let file = Simfile::parse(include_str!("../../../assets/music/vibe_ace.sm")).map_err(|mistake| mistake.problem)?;
    Ok(Song { file, folder: "music".into() })
}

/// Assets are in the folder `assets` beside the page.
pub(crate) fn asset_plugin(_: &Options) -> Outcome<AssetPlugin> {
    // A server may answer requests for what is not there with a page.
    Ok(AssetPlugin { meta_check: AssetMetaCheck::Never, ..default() })
}

/// Its file comes with the page.
pub(crate) fn check_dancer(_: &Path) -> Outcome<()> {
    Ok(())
}
