//! Systems that move the camera and the anchors to the detected markers.

use super::{
    DetectedMarkers, MarkerAnchor, MarkerBoard, MarkerState, MarkerTracking, MarkerViews, WorldOrigin,
    board_pose::AnchorPose,
    placement::Placement,
    same_number::{FollowedSheets, SameNumber},
};
use crate::camera::{ArCamera, CameraFrame, Intrinsics, camera_rank};
use bevy::{ecs::entity::EntityHashMap, prelude::*};

type ChangedAnchor = Or<(Changed<MarkerAnchor>, Changed<MarkerBoard>)>;

pub(super) fn check_anchors(anchors: Query<(Entity, &MarkerAnchor, Option<&MarkerBoard>), ChangedAnchor>) {
    for (entity, anchor, board) in &anchors {
        if let Err(error) = anchor.check() {
            error!("MarkerAnchor of {entity}: {error}");
        } else if let Some(Err(error)) = board.map(|board| board.check(anchor)) {
            error!("MarkerBoard of {entity}: {error}; only the marker of the MarkerAnchor is tracked");
        }
    }
}

type TrackedCamera = (Entity, &'static Camera, &'static ArCamera, &'static CameraFrame, Ref<'static, DetectedMarkers>);
type TrackedAnchor = (
    Entity,
    Ref<'static, MarkerAnchor>,
    Option<Ref<'static, MarkerBoard>>,
    &'static mut MarkerTracking,
    &'static mut MarkerViews,
    &'static mut FollowedSheets,
);

/// Estimates the pose of each marker in the newest frame of each camera.
pub(super) fn estimate_poses(cameras: Query<TrackedCamera>, mut anchors: Query<TrackedAnchor>) {
    let mut sorted: Vec<_> = cameras.iter().collect();
    sorted.sort_by_key(|(entity, camera, ..)| camera_rank(*entity, camera));
    let is_assumed =
        |ar_camera: &ArCamera, frame: &CameraFrame| ar_camera.intrinsics.is_none() && frame.intrinsics.is_none();
    if !anchors.is_empty() && sorted.iter().any(|(_, _, ar_camera, frame, _)| is_assumed(ar_camera, frame)) {
        warn_once!("ArCamera has no intrinsics: poses are measured with an assumed field of view of 60°");
    }
    for (entity, anchor, board, mut tracking, mut views, mut sheets) in &mut anchors {
        let mut is_new = false;
        if views.iter().any(|(camera, _)| !cameras.contains(camera)) {
            views.retain(|camera| cameras.contains(camera));
            sheets.retain(|camera| cameras.contains(camera));
            is_new = true;
        }
        if anchor.check().is_err() {
            continue;
        }
        let is_changed = anchor.is_changed() || board.as_ref().is_some_and(|board| board.is_changed());
        let board = board.as_deref().filter(|board| board.check(&anchor).is_ok());
        for (camera, _, ar_camera, frame, detected) in &sorted {
            if detected.is_changed() || is_changed {
                let intrinsics = ar_camera.intrinsics_for(frame);
                let sheet = sheets.of(*camera);
                views.of(*camera).update((&anchor, board), detected, sheet, &intrinsics);
                sheet.report_copies(entity, &anchor, *camera, views.of(*camera).copies);
                is_new = true;
            }
        }
        let best = is_new.then(|| {
            let seen = sorted.iter().filter_map(|(camera, ..)| views.get(*camera));
            seen.min_by_key(|view| (view.state.preference(), view.camera != tracking.camera))
        });
        if let Some(best) = best.flatten() {
            *tracking = best.clone();
        }
    }
}

impl MarkerState {
    /// Sorts the views of a marker: the smaller, the better.
    fn preference(self) -> u8 {
        match self {
            Self::Tracked => 0,
            Self::Lost => 1,
            Self::Searching => 2,
        }
    }
}

impl MarkerTracking {
    /// Follows the sheet of an anchor among the markers that were detected in a frame.
    fn update(
        &mut self,
        (anchor, board): (&MarkerAnchor, Option<&MarkerBoard>),
        detected: &DetectedMarkers,
        sheet: &mut SameNumber,
        intrinsics: &Intrinsics,
    ) {
        let seen: Vec<_> = detected.markers.iter().filter(|marker| marker.marker() == anchor.marker()).collect();
        self.copies = seen.len() as u32;
        let estimated = AnchorPose::estimate(anchor, board, sheet.choose(&seen), &detected.markers, intrinsics);
        self.candidates = estimated.as_ref().map(|estimated| estimated.candidates);
        match estimated {
            Some(AnchorPose { candidates, markers }) => {
                self.markers = markers;
                let pose = candidates.choose(self.camera_from_marker.as_ref());
                self.state = MarkerState::Tracked;
                self.camera_from_marker = Some(pose.camera_from_marker);
                self.reprojection_error = pose.reprojection_error;
                self.last_seen = Some(detected.sequence);
            }
            None if self.camera_from_marker.is_some() => self.state = MarkerState::Lost,
            None => self.state = MarkerState::Searching,
        }
    }
}

type PosedAnchor = (Entity, &'static MarkerViews, Has<WorldOrigin>);

/// Moves each camera to where its frames show the origin of the world, and the other anchors to where the cameras see
/// them.
pub(super) fn apply_poses(
    mut commands: Commands,
    cameras: Query<(Entity, &Camera), (With<ArCamera>, With<DetectedMarkers>)>,
    anchors: Query<PosedAnchor, With<MarkerAnchor>>,
    placement: Placement,
) {
    let mut sorted: Vec<_> = cameras.iter().collect();
    sorted.sort_by_key(|(entity, camera)| camera_rank(*entity, camera));
    let mut origins: Vec<_> = anchors.iter().filter(|(.., is_origin)| *is_origin).collect();
    origins.sort_by_key(|(entity, ..)| *entity);
    if origins.len() > 1 {
        warn_once!("{} anchors have WorldOrigin; only {} is the origin of the world", origins.len(), origins[0].0);
    }
    let mut moved = EntityHashMap::default();
    if let Some((origin, views, _)) = origins.first()
        && let Some(world_from_origin) = placement.world_from(*origin)
    {
        for (camera, _) in &sorted {
            if let Some(pose) = views.get(*camera).and_then(|view| view.camera_from_marker) {
                let world_from_camera = world_from_origin * pose.inverse();
                placement.place(&mut commands, *camera, world_from_camera);
                moved.insert(*camera, world_from_camera);
            }
        }
        // Anchors are placed by cameras whose pose is known, if there are any.
        sorted.sort_by_key(|(camera, _)| !moved.contains_key(camera));
    }
    let origin = origins.first().map(|(entity, ..)| *entity);
    for (anchor, views, _) in anchors.iter().filter(|(entity, ..)| Some(*entity) != origin) {
        let seen = sorted.iter().find_map(|(camera, _)| {
            let view = views.get(*camera).filter(|view| view.state == MarkerState::Tracked)?;
            Some((*camera, view.camera_from_marker?))
        });
        let Some((camera, pose)) = seen else { continue };
        if let Some(world_from_camera) = moved.get(&camera).copied().or_else(|| placement.world_from(camera)) {
            placement.place(&mut commands, anchor, world_from_camera * pose);
        }
    }
}
