//! Systems that move the camera and the anchors to the detected markers.

use super::{
    DetectedMarkers, MarkerAnchor, MarkerState, MarkerTracking, PoseCandidates, WorldOrigin, same_number::SameNumber,
};
use crate::camera::{ArCamera, CameraFrame};
use bevy::prelude::*;

pub(super) fn check_anchors(anchors: Query<(Entity, &MarkerAnchor), Changed<MarkerAnchor>>) {
    for (entity, anchor) in &anchors {
        if let Err(error) = anchor.check() {
            error!("MarkerAnchor of {entity}: {error}");
        }
    }
}

type TrackedAnchor = (Entity, Ref<'static, MarkerAnchor>, &'static mut MarkerTracking, &'static mut SameNumber);

pub(super) fn estimate_poses(
    cameras: Query<(&ArCamera, &CameraFrame, Ref<DetectedMarkers>)>,
    mut anchors: Query<TrackedAnchor>,
) {
    // Only the first AR camera is tracked.
    let Some((ar_camera, frame, detected)) = cameras.iter().next() else {
        return;
    };
    if ar_camera.intrinsics.is_none() && frame.intrinsics.is_none() && !anchors.is_empty() {
        warn_once!("ArCamera has no intrinsics: poses are measured with an assumed field of view of 60°");
    }
    let intrinsics = ar_camera.intrinsics_for(frame);
    for (entity, anchor, mut tracking, mut same_number) in &mut anchors {
        if !(detected.is_changed() || anchor.is_changed()) || anchor.check().is_err() {
            continue;
        }
        let seen: Vec<_> = detected.markers.iter().filter(|marker| marker.id == anchor.id).collect();
        tracking.copies = seen.len() as u32;
        if seen.len() > 1 && !same_number.is_reported {
            same_number.is_reported = true;
            warn!(
                "MarkerAnchor of {entity}: {} sheets with the number {} are in the frame; the one that was seen first is \
                 followed. Cover the others or print them with other numbers",
                seen.len(),
                anchor.id
            );
        }
        let candidates = same_number
            .choose(&seen)
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
