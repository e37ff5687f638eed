//! Detector of a game, and the systems that run it.

use super::{
    BoardMarker, DetectedMarkers, MarkerAnchor, MarkerBoard, MarkerDetector, MarkerFamily, MarkerId, MarkerTracker,
    TrackingError, detect_markers::detect_mirrored,
};
use crate::{
    camera::{ArCamera, ArrivingFrame, CameraFrame, UndistortionMaps},
    frame_tasks::spawn_for_frame,
};
use bevy::{
    ecs::entity::EntityHashMap,
    platform::time::Instant,
    prelude::*,
    tasks::{Task, futures::check_ready},
};
use std::sync::{Arc, Mutex, PoisonError};

/// Marker detector of a game: that of AprilTag, unless the game inserts its own. Runs in the background for live
/// feeds.
#[derive(Resource, Reflect, Clone)]
#[reflect(opaque, Resource, Clone)]
pub struct MarkerDetection(Arc<Mutex<dyn MarkerDetector>>);

impl MarkerDetection {
    /// Wraps a detector of the game.
    pub fn new(detector: impl MarkerDetector + 'static) -> Self {
        Self(Arc::new(Mutex::new(detector)))
    }

    /// The detector that this crate was built with.
    ///
    /// # Errors
    /// [`TrackingError::NoDetector`] without the features `apriltag` and `locus`; [`TrackingError::WrongLibrary`] if a
    /// system library of another version was linked; [`TrackingError::OutOfMemory`] if the library could not allocate.
    pub fn built_in() -> Result<Self, TrackingError> {
        #[cfg(feature = "apriltag")]
        return Ok(Self::new(super::AprilTagDetector::new()?));
        #[cfg(all(not(feature = "apriltag"), feature = "locus"))]
        return Ok(Self::new(super::LocusDetector::new()));
        #[cfg(not(any(feature = "apriltag", feature = "locus")))]
        Err(TrackingError::NoDetector)
    }

    /// Runs a tracker on the next frame of its camera and measures the time; now and then looks for markers in the
    /// mirror image if none of the wanted ones is there. Waits while a frame of another camera is searched.
    fn detect(
        &self,
        frame: &CameraFrame,
        groups: &[Vec<MarkerId>],
        last_mirrored: &[MarkerId],
        tracker: &mut MarkerTracker,
    ) -> DetectedMarkers {
        let wanted = &groups.concat();
        // A detector that panicked once may work on the next frame.
        let mut detector = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let started = Instant::now();
        if let Err(error) = detector.set_families(&families_of(wanted)) {
            error_once!("MarkerDetection: {error}");
        }
        let missed = tracker.worth_a_search(groups);
        let markers = tracker.detect(&mut *detector, &frame.pixels, &missed);
        let is_seen = markers.iter().any(|marker| wanted.contains(&marker.marker()));
        let mirrored = match () {
            () if wanted.is_empty() || is_seen => Vec::new(),
            () if frame.sequence.saturating_sub(1).is_multiple_of(MIRROR_INTERVAL) => {
                detect_mirrored(&mut *detector, &frame.pixels, wanted)
            }
            () => last_mirrored.to_vec(),
        };
        if !mirrored.is_empty() {
            let markers: Vec<_> = mirrored.iter().map(MarkerId::to_string).collect();
            warn_once!(
                "the frames of the camera are mirrored: {} can be read in their mirror image only. Switch mirroring off \
                 where the frames come from, or flip them before they become frames",
                markers.join(", ")
            );
        }
        DetectedMarkers { sequence: frame.sequence, markers, cpu_time: started.elapsed(), mirrored }
    }
}

/// Number of frames from one search of the mirror image to the next.
const MIRROR_INTERVAL: u64 = 30;

type WantedAnchor = (Ref<'static, MarkerAnchor>, Option<Ref<'static, MarkerBoard>>);

/// Markers of each valid anchor of the game: its own and those of its board, any of which gives its pose.
fn wanted_groups(anchors: &Query<WantedAnchor>) -> Vec<Vec<MarkerId>> {
    let valid = anchors.iter().filter(|(anchor, _)| anchor.check().is_ok());
    let markers = |(anchor, board): (Ref<MarkerAnchor>, Option<Ref<MarkerBoard>>)| {
        let board = board.filter(|board| board.check(&anchor).is_ok());
        let others = board.iter().flat_map(|board| &board.markers).map(BoardMarker::marker);
        [anchor.marker()].into_iter().chain(others).collect()
    };
    valid.map(markers).collect()
}

/// Families to search for: those of the wanted markers, and tag36h11 if none are wanted.
fn families_of(wanted: &[MarkerId]) -> Vec<MarkerFamily> {
    let mut families: Vec<_> = wanted.iter().map(|marker| marker.family).collect();
    families.sort_unstable();
    families.dedup();
    if families.is_empty() { vec![MarkerFamily::default()] } else { families }
}

/// A frame that is being undistorted and searched for markers in the background. Without a detector there is no search.
#[derive(Component)]
pub(super) struct RunningDetection(Task<(CameraFrame, Option<(DetectedMarkers, MarkerTracker)>)>);

type ArrivedCamera = (
    Entity,
    &'static ArrivingFrame,
    Option<&'static ArCamera>,
    Has<RunningDetection>,
    Option<&'static DetectedMarkers>,
    Option<&'static MarkerTracker>,
);

/// Publishes live frames, undistorted, together with their markers. Searches one frame of a camera at a time.
pub(super) fn detect_in_background(
    mut commands: Commands,
    detection: Option<Res<MarkerDetection>>,
    mut running: Query<(Entity, &mut RunningDetection)>,
    arrived: Query<ArrivedCamera>,
    anchors: Query<WantedAnchor>,
    maps: Res<UndistortionMaps>,
) {
    // Commands take effect after this system, so the newest tracker is not on its camera yet.
    let mut finished = EntityHashMap::default();
    for (camera, mut running) in &mut running {
        if let Some((frame, found)) = check_ready(&mut running.0) {
            let tracker = found.as_ref().map(|(_, tracker)| tracker.clone());
            finished.insert(camera, tracker.unwrap_or_default());
            let mut camera = commands.entity(camera);
            camera.remove::<RunningDetection>().insert(frame);
            if let Some(found) = found {
                camera.insert(found);
            }
        }
    }
    for (camera, arriving, ar_camera, is_running, last, tracker) in &arrived {
        let finished = finished.remove(&camera);
        if is_running && finished.is_none() {
            continue;
        }
        let mut tracker = finished.or_else(|| tracker.cloned()).unwrap_or_default();
        let mut frame = arriving.0.clone();
        let lens = ar_camera.and_then(|camera| camera.distorting_lens(frame.intrinsics, frame.pixels.size));
        let mut camera = commands.entity(camera);
        camera.remove::<ArrivingFrame>();
        if detection.is_none() && lens.is_none() {
            camera.insert(frame);
            continue;
        }
        let detection = detection.as_deref().cloned();
        let groups = wanted_groups(&anchors);
        let mirrored = last.map_or_else(Vec::new, |last| last.mirrored.clone());
        let maps = maps.clone();
        let search = async move {
            maps.undistort(&mut frame.pixels, lens.as_ref());
            let detected = detection.map(|detection| detection.detect(&frame, &groups, &mirrored, &mut tracker));
            (frame, detected.map(|detected| (detected, tracker)))
        };
        camera.insert(RunningDetection(spawn_for_frame(search)));
    }
}

type FramedCamera = (Entity, &'static CameraFrame, Option<&'static DetectedMarkers>, Option<&'static MarkerTracker>);

/// Searches frames that were published without markers: those of feeds in lockstep, and those that the game inserts
/// itself.
pub(super) fn detect_at_once(
    mut commands: Commands,
    detection: Option<Res<MarkerDetection>>,
    cameras: Query<FramedCamera, With<ArCamera>>,
    anchors: Query<WantedAnchor>,
) {
    let anchors_changed =
        anchors.iter().any(|(anchor, board)| anchor.is_changed() || board.is_some_and(|board| board.is_changed()));
    let groups = wanted_groups(&anchors);
    let is_due = |frame: &CameraFrame, last: Option<&DetectedMarkers>| {
        let Some(last) = last.filter(|last| last.sequence == frame.sequence) else {
            return true;
        };
        // An anchor that was added after the frame may need the search at full resolution.
        let is_found = |wanted: &MarkerId| last.markers.iter().any(|marker| marker.marker() == *wanted);
        anchors_changed && !groups.iter().flatten().all(is_found)
    };
    for (camera, frame, last, tracker) in &cameras {
        if !is_due(frame, last) {
            continue;
        }
        let Some(detection) = &detection else {
            if !groups.is_empty() {
                warn_once!("{}", TrackingError::NoDetector);
            }
            return;
        };
        let mirrored = last.map_or(&[][..], |last| &last.mirrored);
        // A frame that was searched before is none that follows.
        let is_next = last.is_none_or(|last| last.sequence != frame.sequence);
        let mut tracker = tracker.filter(|_| is_next).cloned().unwrap_or_default();
        let detected = detection.detect(frame, &groups, mirrored, &mut tracker);
        commands.entity(camera).insert((detected, tracker));
    }
}
