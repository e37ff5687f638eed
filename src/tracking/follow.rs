//! The systems that keep camera and anchors where the markers say.

use super::{
    DetectedMarkers, MarkerAnchor, MarkerDetection, MarkerState, MarkerTracking, PoseCandidates, TrackingError,
    WorldOrigin,
};
use crate::camera::{ArCamera, ArrivingFrame, CameraFrame};
use bevy::{
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, TaskPool, futures::check_ready},
};

pub(super) fn check_anchors(anchors: Query<(Entity, &MarkerAnchor), Changed<MarkerAnchor>>) {
    for (entity, anchor) in &anchors {
        if let Err(error) = anchor.check() {
            error!("MarkerAnchor of {entity}: {error}");
        }
    }
}

/// The numbers that the game's anchors wait for.
fn wanted_ids<'a>(anchors: impl Iterator<Item = &'a MarkerAnchor>) -> Vec<u32> {
    anchors.filter(|anchor| anchor.check().is_ok()).map(|anchor| anchor.id).collect()
}

/// A picture that is being searched for markers in the background.
#[derive(Component)]
pub(super) struct RunningDetection(Task<(CameraFrame, DetectedMarkers)>);

type ArrivedCamera = (Entity, &'static ArrivingFrame, Has<RunningDetection>);

/// Lets pictures through together with their markers; one picture of a camera is searched at a time.
pub(super) fn detect_in_background(
    mut commands: Commands,
    detection: Option<Res<MarkerDetection>>,
    mut running: Query<(Entity, &mut RunningDetection)>,
    arrived: Query<ArrivedCamera>,
    anchors: Query<&MarkerAnchor>,
) {
    let mut finished = Vec::new();
    for (camera, mut running) in &mut running {
        if let Some(found) = check_ready(&mut running.0) {
            commands.entity(camera).remove::<RunningDetection>().insert(found);
            finished.push(camera);
        }
    }
    for (camera, arriving, is_running) in &arrived {
        if is_running && !finished.contains(&camera) {
            continue;
        }
        let frame = arriving.0.clone();
        let mut camera = commands.entity(camera);
        camera.remove::<ArrivingFrame>();
        let Some(detection) = detection.as_deref().cloned() else {
            camera.insert(frame);
            continue;
        };
        let wanted = wanted_ids(anchors.iter());
        let search = async move {
            let (markers, cpu_time) = detection.find(&frame.pixels, &wanted);
            let detected = DetectedMarkers { sequence: frame.sequence, markers, cpu_time };
            (frame, detected)
        };
        camera.insert(RunningDetection(AsyncComputeTaskPool::get_or_init(TaskPool::default).spawn(search)));
    }
}

type FramedCamera = (Entity, &'static CameraFrame, Option<&'static DetectedMarkers>);

/// Searches pictures that were let through without: those of feeds in lockstep, and those the game inserts itself.
pub(super) fn detect_markers(
    mut commands: Commands,
    detection: Option<Res<MarkerDetection>>,
    cameras: Query<FramedCamera, With<ArCamera>>,
    anchors: Query<Ref<MarkerAnchor>>,
) {
    let anchors_changed = anchors.iter().any(|anchor| anchor.is_changed());
    let wanted = wanted_ids(anchors.iter().map(Ref::into_inner));
    let is_due = |frame: &CameraFrame, last: Option<&DetectedMarkers>| {
        let Some(last) = last.filter(|last| last.sequence == frame.sequence) else {
            return true;
        };
        // An anchor that came after the picture may be worth the search at full resolution.
        anchors_changed && wanted.iter().any(|id| last.markers.iter().all(|marker| marker.id != *id))
    };
    for (camera, frame, last) in &cameras {
        if !is_due(frame, last) {
            continue;
        }
        let Some(detection) = &detection else {
            if !wanted.is_empty() {
                warn_once!("{}", TrackingError::NoDetector);
            }
            return;
        };
        let (markers, cpu_time) = detection.find(&frame.pixels, &wanted);
        commands.entity(camera).insert(DetectedMarkers { sequence: frame.sequence, markers, cpu_time });
    }
}

type TrackedAnchor = (Ref<'static, MarkerAnchor>, &'static mut MarkerTracking);

pub(super) fn estimate_poses(
    cameras: Query<(&ArCamera, &CameraFrame, Ref<DetectedMarkers>)>,
    mut anchors: Query<TrackedAnchor>,
) {
    // Several AR cameras need an anchor each; the first one leads.
    let Some((ar_camera, frame, detected)) = cameras.iter().next() else {
        return;
    };
    if ar_camera.intrinsics.is_none() && frame.intrinsics.is_none() && !anchors.is_empty() {
        warn_once!("ArCamera has no intrinsics: poses are measured with an assumed field of view of 60°");
    }
    let intrinsics = ar_camera.intrinsics_for(frame);
    for (anchor, mut tracking) in &mut anchors {
        if !(detected.is_changed() || anchor.is_changed()) || anchor.check().is_err() {
            continue;
        }
        let candidates = detected
            .markers
            .iter()
            .find(|marker| marker.id == anchor.id)
            .and_then(|marker| PoseCandidates::from_corners(&marker.corners, &intrinsics, anchor.size.into()));
        tracking.candidates = candidates;
        match candidates {
            Some(candidates) => {
                let pose = candidates.choose(tracking.camera_from_marker.as_ref());
                tracking.state = MarkerState::Tracked;
                tracking.camera_from_marker = Some(pose.camera_from_marker);
                tracking.reprojection_error = pose.reprojection_error;
                tracking.last_seen = Some(detected.sequence);
            }
            None if tracking.camera_from_marker.is_some() => tracking.state = MarkerState::Lost,
            None => tracking.state = MarkerState::Searching,
        }
    }
}

type PosedAnchor = (Entity, &'static MarkerTracking, Has<WorldOrigin>);

pub(super) fn apply_poses(
    mut commands: Commands,
    cameras: Query<Entity, (With<ArCamera>, With<DetectedMarkers>)>,
    anchors: Query<PosedAnchor, With<MarkerAnchor>>,
    parents: Query<&ChildOf>,
    transforms: Query<&Transform>,
    global: TransformHelper,
) {
    let Some(camera) = cameras.iter().next() else {
        return;
    };
    let world_from = |entity: Entity| global.compute_global_transform(entity).ok().map(|t| t.to_isometry());
    let mut place = |entity: Entity, world_from_entity: Isometry3d| {
        let world_from_parent = parents.get(entity).ok().and_then(|parent| world_from(parent.parent()));
        let local = world_from_parent.unwrap_or_default().inverse() * world_from_entity;
        if let Ok(transform) = transforms.get(entity) {
            let placed = Transform { scale: transform.scale, ..Transform::from_isometry(local) };
            if *transform != placed {
                commands.entity(entity).insert(placed);
            }
        }
    };
    let mut origins: Vec<_> = anchors.iter().filter(|(.., is_origin)| *is_origin).collect();
    origins.sort_by_key(|(entity, ..)| *entity);
    if origins.len() > 1 {
        warn_once!("{} anchors have WorldOrigin; only {} is the origin of the world", origins.len(), origins[0].0);
    }
    let mut world_from_camera = world_from(camera);
    if let Some((origin, tracking, _)) = origins.first()
        && let (Some(pose), Some(world_from_anchor)) = (tracking.camera_from_marker, world_from(*origin))
    {
        let moved = world_from_anchor * pose.inverse();
        place(camera, moved);
        world_from_camera = Some(moved);
    }
    let origin = origins.first().map(|(entity, ..)| *entity);
    for (anchor, tracking, _) in anchors.iter().filter(|(entity, ..)| Some(*entity) != origin) {
        if let (MarkerState::Tracked, Some(pose), Some(camera)) =
            (tracking.state, tracking.camera_from_marker, world_from_camera)
        {
            place(anchor, camera * pose);
        }
    }
}
