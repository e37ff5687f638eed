//! Views from a webcam: one wherever the board is held still at a new place.

use crate::options::Options;
use bevy::{math::DVec2, prelude::*};
use bevy_mirrorball::{
    camera::{
        CameraFrame, CameraPlugin, DeviceId, DeviceOptions, FeedState, FramePixels,
        calibration::{CalibrationView, MIN_POINTS},
    },
    prelude::*,
    tracking::{AprilTagDetector, LumaView, MarkerDetector},
};
use std::time::{Duration, Instant};

/// Mean movement of the board from one frame to the next, as a fraction of the frame's width, up to which it is held
/// still.
const STILL: f64 = 0.002;
/// Mean distance from every view taken before, as a fraction of the width, from which on a place is new.
const NEW: f64 = 0.08;
/// Longest wait for a new view, or for the camera.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// Takes views until there are enough, or none came for a minute.
pub(crate) fn take_views(number: u32, options: &Options) -> Result<Vec<FramePixels>, Box<dyn std::error::Error>> {
    let device = DeviceOptions { device: DeviceId::Index(number), size: Some(options.resolution.into()), ..default() };
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, CameraPlugin));
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::device(device))).id();
    let mut detector = AprilTagDetector::new()?;
    let (mut frames, mut taken, mut last) = (Vec::new(), Vec::new(), CalibrationView::default());
    let (mut sequence, mut newest) = (0, Instant::now());
    println!("show the board; a view is taken where it is held still");
    while frames.len() < options.views {
        if newest.elapsed() > MAX_WAIT {
            break;
        }
        app.update();
        std::thread::sleep(Duration::from_millis(5));
        if let Some(FeedState::Failed(reason) | FeedState::Lost(reason)) = app.world().get::<FeedState>(camera) {
            if frames.is_empty() {
                return Err(reason.clone().into());
            }
            println!("{reason}");
            break;
        }
        let Some(frame) = app.world().get::<CameraFrame>(camera).filter(|frame| frame.sequence > sequence) else {
            continue;
        };
        sequence = frame.sequence;
        let luma = frame.pixels.luma8();
        let Some(image) = LumaView::new(frame.pixels.size, &luma) else {
            continue;
        };
        let view = options.board.view(&detector.detect(image, 2.0));
        let width = f64::from(frame.pixels.size.x);
        let is_still = movement(&view, &last) < STILL * width;
        last = view.clone();
        let is_new = taken.iter().all(|other| movement(&view, other) > NEW * width);
        if view.points.len() < MIN_POINTS || !is_still || !is_new {
            continue;
        }
        frames.push(FramePixels { size: frame.pixels.size, rgba: frame.pixels.rgba.clone() });
        println!("view {} of {}: {} markers", frames.len(), options.views, view.points.len() / 4);
        taken.push(view);
        newest = Instant::now();
    }
    Ok(frames)
}

/// Mean distance between the points that two views have in common; infinite if there are none.
fn movement(view: &CalibrationView, other: &CalibrationView) -> f64 {
    let same = |board: DVec2| other.points.iter().find(|point| point.board == board);
    let distances: Vec<f64> =
        view.points.iter().filter_map(|point| Some(point.frame.distance(same(point.board)?.frame))).collect();
    if distances.is_empty() { f64::INFINITY } else { distances.iter().sum::<f64>() / distances.len() as f64 }
}
