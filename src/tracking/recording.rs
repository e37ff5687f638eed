//! Recordings of camera feeds that play back with the same poses.

use super::{
    MarkerAnchor, MarkerId, MarkerTracker, MarkerTracking, MarkerViews, PoseFilter, detection::RunningDetection,
    filtered_pose::PoseHistories, same_number::FollowedSheets,
};
use crate::camera::{ArCamera, CameraFeed, CameraFrame, FramePixels, SidecarTracking};
use bevy::{ecs::observer::On, prelude::*};
use image::{
    ExtendedColorType, ImageEncoder,
    codecs::png::{CompressionType, FilterType, PngEncoder},
};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::{
    fs,
    io::BufWriter,
    path::{Path, PathBuf},
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, SyncSender, TrySendError, sync_channel},
    },
    thread,
};

/// Records the frames of a camera as a [`Clip`](crate::camera::Clip); on its entity. Recording ends when the component
/// is taken away.
///
/// Frames are written as PNG by a thread of their own. The sidecar has their times of capture, the intrinsics and the
/// [`PoseFilter`] of each anchor, so the recording plays back with the same poses, to the last bit, if the same markers
/// are wanted. For that, tracking forgets its past when recording starts. Bracketed exposures are not recorded. On the
/// web, which has neither threads nor folders, [`error`](Self::error) says so.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, tracking::FrameRecorder};
/// fn toggle(mut commands: Commands, camera: Single<(Entity, Has<FrameRecorder>), With<ArCamera>>) {
///     let (camera, is_recording) = *camera;
///     if is_recording {
///         commands.entity(camera).remove::<FrameRecorder>();
///     } else {
///         commands.entity(camera).insert(FrameRecorder::new("recordings/desk"));
///     }
/// }
/// ```
#[derive(Component, Reflect, Debug)]
#[reflect(from_reflect = false, Component, Debug)]
pub struct FrameRecorder {
    folder: PathBuf,
    #[reflect(ignore)]
    writer: Option<Writer>,
    #[reflect(ignore)]
    error: Arc<Mutex<Option<String>>>,
}

#[derive(Debug)]
struct Writer {
    frames: SyncSender<CameraFrame>,
    last: Option<u64>,
}

impl FrameRecorder {
    /// Records into a folder, which is created; relative paths start in the working directory. Files that are in it are
    /// overwritten.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), writer: None, error: Arc::default() }
    }

    /// Why recording has stopped, if it has: the folder or a file could not be written.
    pub fn error(&self) -> Option<String> {
        self.error.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn fail(&self, reason: &str) {
        report(&self.folder, &self.error, reason);
    }

    fn start(&mut self, settings: Recorded) -> &mut Writer {
        self.writer.get_or_insert_with(|| {
            let (frames, received) = sync_channel(MAX_WAITING);
            let (folder, error) = (self.folder.clone(), self.error.clone());
            let thread = thread::Builder::new().name("frame recorder".to_owned()).spawn(move || {
                if let Err(reason) = write(&folder, &settings, &received) {
                    report(&folder, &error, &reason.to_string());
                }
            });
            // On the web there are no threads.
            if let Err(reason) = thread {
                report(&self.folder, &self.error, &reason.to_string());
            }
            Writer { frames, last: None }
        })
    }
}

fn report(folder: &Path, error: &Mutex<Option<String>>, reason: &str) {
    let text = format!("cannot record into {}: {reason}", folder.display());
    error!("FrameRecorder: {text}");
    *error.lock().unwrap_or_else(PoisonError::into_inner) = Some(text);
}

/// What a sidecar says of the tracking at the time of the recording.
#[derive(Component, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Recorded {
    /// Whether the feed was live.
    is_live: bool,
    filters: Vec<RecordedFilter>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RecordedFilter {
    #[serde(flatten)]
    marker: MarkerId,
    filter: PoseFilter,
}

impl Recorded {
    /// Filter of a marker, and whether it smoothed.
    pub(super) fn filter(&self, marker: MarkerId, of_anchor: &PoseFilter) -> (PoseFilter, bool) {
        let recorded = self.filters.iter().find(|recorded| recorded.marker == marker);
        let filter = recorded.map_or(*of_anchor, |recorded| recorded.filter);
        (filter, filter.applies_to(self.is_live))
    }
}

/// Reads how a recording was tracked, when a camera begins to play it.
pub(super) fn read_sidecar(
    inserted: On<Insert, SidecarTracking>,
    mut commands: Commands,
    sidecars: Query<&SidecarTracking>,
) {
    let camera = inserted.entity;
    let Ok(sidecar) = sidecars.get(camera) else { return };
    match serde_json::from_value::<Recorded>(sidecar.0.clone()) {
        Ok(recorded) => {
            commands.entity(camera).try_insert(recorded);
        }
        Err(error) => warn!(
            "camera {camera}: \"tracking\" in clip.json cannot be read: {error}. Poses are filtered as the anchors say; record \
             again to repair it"
        ),
    }
}

/// Forgets it when the camera plays something else.
pub(super) fn forget_sidecar(removed: On<Remove, SidecarTracking>, mut commands: Commands) {
    if let Ok(mut camera) = commands.get_entity(removed.entity) {
        camera.try_remove::<Recorded>();
    }
}

/// Forgets the past of all markers in the frames of a camera whose recording starts.
pub(super) fn forget_past(
    added: On<Add, FrameRecorder>,
    mut commands: Commands,
    mut anchors: Query<(&mut MarkerTracking, &mut MarkerViews, &mut FollowedSheets, &mut PoseHistories)>,
) {
    let camera = added.entity;
    commands.entity(camera).try_remove::<(RunningDetection, MarkerTracker)>();
    for (mut tracking, mut views, mut sheets, mut histories) in &mut anchors {
        if tracking.camera == Some(camera) {
            *tracking = MarkerTracking::default();
        }
        views.retain(|of| of != camera);
        sheets.retain(|of| of != camera);
        histories.retain(|of| of != camera);
    }
}

type RecordedCamera =
    (&'static mut FrameRecorder, &'static CameraFrame, &'static ArCamera, Option<&'static CameraFeed>);

/// Passes new frames on to be written.
pub(super) fn record_frames(
    mut cameras: Query<RecordedCamera, Changed<CameraFrame>>,
    anchors: Query<(&MarkerAnchor, &PoseFilter)>,
) {
    for (mut recorder, frame, camera, feed) in &mut cameras {
        let settings = || Recorded {
            is_live: feed.is_some_and(CameraFeed::is_video),
            filters: anchors
                .iter()
                .map(|(anchor, filter)| RecordedFilter { marker: anchor.marker(), filter: *filter })
                .collect(),
        };
        let frame = CameraFrame { intrinsics: Some(camera.intrinsics_for(frame)), ..frame.clone() };
        if recorder.error().is_some() {
            continue;
        }
        let writer = recorder.start(settings());
        // Of a thread that is gone after an error, the error is known.
        if writer.last.replace(frame.sequence) != Some(frame.sequence)
            && let Err(TrySendError::Full(_)) = writer.frames.try_send(frame)
        {
            recorder.fail("frames arrive faster than they can be written; record smaller ones or on a faster disk");
        }
    }
}

/// Number of frames that may wait to be written.
const MAX_WAITING: usize = 120;
/// Number of frames after which the sidecar is written, so that a crash costs few of them.
const SIDECAR_INTERVAL: usize = 30;

type Written = Result<(), Box<dyn std::error::Error>>;

/// Writes frames until no more come.
fn write(folder: &Path, settings: &Recorded, frames: &Receiver<CameraFrame>) -> Written {
    fs::create_dir_all(folder)?;
    let mut first: Option<CameraFrame> = None;
    let mut times = Vec::new();
    for frame in frames {
        let first = first.get_or_insert_with(|| frame.clone());
        if frame.pixels.size != first.pixels.size {
            let (before, now) = (first.pixels.size, frame.pixels.size);
            return Err(format!("the size of the frames changes from {before} to {now}; record again").into());
        }
        let name = format!("frame_{:06}.png", times.len());
        write_png(&folder.join(name), &frame.pixels)?;
        times.push(frame.captured.saturating_sub(first.captured).as_secs_f64());
        if times.len() % SIDECAR_INTERVAL == 1 {
            write_sidecar(folder, settings, first, &times)?;
        }
    }
    first.map_or(Ok(()), |first| write_sidecar(folder, settings, &first, &times))
}

fn write_png(path: &Path, pixels: &FramePixels) -> Written {
    let rgb: Vec<u8> = pixels.rgba.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    let file = BufWriter::new(fs::File::create(path)?);
    let encoder = PngEncoder::new_with_quality(file, CompressionType::Fast, FilterType::Sub);
    encoder.write_image(&rgb, pixels.size.x, pixels.size.y, ExtendedColorType::Rgb8)?;
    Ok(())
}

fn write_sidecar(folder: &Path, settings: &Recorded, first: &CameraFrame, times: &[f64]) -> Written {
    let duration = times.last().copied().unwrap_or_default();
    let rate = if duration > 0.0 { (times.len() - 1) as f64 / duration } else { 1.0 };
    let mut sidecar = json!({
        "image": first.pixels.size.to_array(),
        "fps": rate,
        "pattern": "frame_*.png",
        "times": times,
        "tracking": settings,
    });
    if let Some(k) = first.intrinsics {
        sidecar["intrinsics"] = json!({ "fx": k.focal.x, "fy": k.focal.y, "cx": k.center.x, "cy": k.center.y });
    }
    // A reader sees the old one or the new one, never half of it.
    let (path, new) = (folder.join("clip.json"), folder.join("clip.json.new"));
    fs::write(&new, serde_json::to_string(&sidecar)?)?;
    fs::rename(new, path)?;
    Ok(())
}
