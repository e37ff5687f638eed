//! Camera feeds from clips, images and games, in the background or in lockstep; errors are states.

mod clip_assets;
mod clips;
mod events;
mod exposure_series;
mod images;
mod paths;
mod search;

use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{CameraPlugin, FeedState, FeedStatistics},
    prelude::*,
};
use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

const SIZE: UVec2 = UVec2::new(8, 6);
/// Deadline for what happens in the background.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// An app that plays feeds and draws nothing.
fn player() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, CameraPlugin));
    app
}

/// A clip of solid gray pictures in a folder of its own: `names` with their brightness, beside a sidecar.
fn write_clip(name: &str, sidecar: &str, pictures: &[(&str, u8)]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the target folder can be written to");
    std::fs::write(folder.join("clip.json"), sidecar).expect("written");
    for (name, gray) in pictures {
        image::GrayImage::from_pixel(SIZE.x, SIZE.y, image::Luma([*gray])).save(folder.join(name)).expect("written");
    }
    folder
}

const SIDECAR: &str =
    r#"{"image": [8, 6], "fps": 10, "intrinsics": {"fx": 7, "fy": 7, "cx": 4, "cy": 3}, "made by": "a test"}"#;

fn state(app: &App, camera: Entity) -> FeedState {
    app.world().get::<FeedState>(camera).expect("comes with the feed").clone()
}

fn statistics(app: &App, camera: Entity) -> FeedStatistics {
    app.world().get::<FeedStatistics>(camera).expect("comes with the feed").clone()
}

fn gray(app: &App, camera: Entity) -> Option<u8> {
    app.world().get::<CameraFrame>(camera).map(|frame| frame.pixels.rgb8(3, 3)[1])
}

/// Updates until something is true, at most for [`MAX_WAIT`].
fn update_until(app: &mut App, mut done: impl FnMut(&mut App) -> bool) -> bool {
    let started = Instant::now();
    while started.elapsed() < MAX_WAIT {
        app.update();
        if done(app) {
            return true;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    false
}
