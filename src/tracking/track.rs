//! Systems that move the camera and the anchors to the detected markers.

use super::{
    DetectedMarkers, MarkerAnchor, MarkerBoard, MarkerId, MarkerState, MarkerTracking, MarkerViews, PoseFilter,
    WorldOrigin,
    board_pose::AnchorPose,
    filtered_pose::{FilteredPose, PoseHistories, PoseHistory},
    placement::Placement,
    recording::Recorded,
    same_number::{FollowedSheets, SameNumber},
    triangulate::{Sighting, triangulate},
};
use crate::camera::{ArCamera, CameraFeed, CameraFrame, camera_rank};
use bevy::{
    ecs::{entity::EntityHashMap, query::QueryData},
    prelude::*,
};
use std::time::Duration;

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

#[derive(QueryData)]
pub(super) struct TrackedCamera {
    entity: Entity,
    camera: &'static Camera,
    ar_camera: &'static ArCamera,
    feed: Option<&'static CameraFeed>,
    recorded: Option<&'static Recorded>,
    frame: &'static CameraFrame,
    detected: Ref<'static, DetectedMarkers>,
}

impl TrackedCameraItem<'_, '_> {
    fn has_assumed_intrinsics(&self) -> bool {
        self.ar_camera.intrinsics.is_none() && self.frame.intrinsics.is_none()
    }

    /// Filter of a marker for the frames of this camera, and whether it smooths them. A recording is smoothed as it was
    /// when it was recorded.
    fn filter(&self, marker: MarkerId, of_anchor: &PoseFilter) -> (PoseFilter, bool) {
        match self.recorded {
            Some(recorded) => recorded.filter(marker, of_anchor),
            None => (*of_anchor, of_anchor.applies_to(self.feed.is_some_and(CameraFeed::is_video))),
        }
    }
}

#[derive(QueryData)]
#[query_data(mutable)]
pub(super) struct TrackedAnchor {
    entity: Entity,
    anchor: Ref<'static, MarkerAnchor>,
    board: Option<Ref<'static, MarkerBoard>>,
    filter: &'static PoseFilter,
    tracking: &'static mut MarkerTracking,
    views: &'static mut MarkerViews,
    sheets: &'static mut FollowedSheets,
    histories: &'static mut PoseHistories,
}

/// Estimates the pose of each marker in the newest frame of each camera.
pub(super) fn estimate_poses(cameras: Query<TrackedCamera>, mut anchors: Query<TrackedAnchor>) {
    let mut sorted: Vec<_> = cameras.iter().collect();
    sorted.sort_by_key(|camera| camera_rank(camera.entity, camera.camera));
    if !anchors.is_empty() && sorted.iter().any(TrackedCameraItem::has_assumed_intrinsics) {
        warn_once!("ArCamera has no intrinsics: poses are measured with an assumed field of view of 60°");
    }
    for mut of in &mut anchors {
        let mut is_new = false;
        if of.views.iter().any(|(camera, _)| !cameras.contains(camera)) {
            of.views.retain(|camera| cameras.contains(camera));
            of.sheets.retain(|camera| cameras.contains(camera));
            of.histories.retain(|camera| cameras.contains(camera));
            is_new = true;
        }
        if of.anchor.check().is_err() {
            continue;
        }
        let is_changed = of.anchor.is_changed() || of.board.as_ref().is_some_and(|board| board.is_changed());
        let board = of.board.as_deref().filter(|board| board.check(&of.anchor).is_ok());
        for camera in &sorted {
            if camera.detected.is_changed() || is_changed {
                let sheet = of.sheets.of(camera.entity);
                let view = of.views.of(camera.entity);
                view.update((&of.anchor, board), camera, sheet, of.histories.of(camera.entity), of.filter);
                sheet.report_copies(of.entity, &of.anchor, camera.entity, view.copies);
                is_new = true;
            }
        }
        let best = is_new.then(|| {
            let seen = sorted.iter().filter_map(|camera| of.views.get(camera.entity));
            seen.min_by_key(|view| (view.state.preference(), view.camera != of.tracking.camera))
        });
        if let Some(best) = best.flatten() {
            *of.tracking = best.clone();
        }
    }
}

impl MarkerState {
    /// Sorts the views of a marker: the smaller, the better.
    fn preference(self) -> u8 {
        match self {
            Self::Tracked => 0,
            Self::Held => 1,
            Self::Lost => 2,
            Self::Searching => 3,
        }
    }
}

impl MarkerTracking {
    /// Follows the sheet of an anchor among the markers that were detected in a frame.
    fn update(
        &mut self,
        (anchor, board): (&MarkerAnchor, Option<&MarkerBoard>),
        camera: &TrackedCameraItem,
        sheet: &mut SameNumber,
        history: &mut PoseHistory,
        of_anchor: &PoseFilter,
    ) {
        let (filter, is_smoothed) = camera.filter(anchor.marker(), of_anchor);
        let (detected, captured) = (&camera.detected, camera.frame.captured);
        let seen: Vec<_> = detected.markers.iter().filter(|marker| marker.marker() == anchor.marker()).collect();
        self.copies = seen.len() as u32;
        let intrinsics = camera.ar_camera.intrinsics_for(camera.frame);
        let estimated = AnchorPose::estimate(anchor, board, sheet.choose(&seen), &detected.markers, &intrinsics);
        self.candidates = estimated.as_ref().map(|estimated| estimated.candidates);
        self.steady = false;
        let Some(AnchorPose { candidates, markers }) = estimated else {
            self.miss(captured, history, &filter);
            return;
        };
        let first_seen = *history.first_seen.get_or_insert(captured);
        let is_found = matches!(self.state, MarkerState::Tracked | MarkerState::Held);
        if !is_found && captured.saturating_sub(first_seen) < filter.found_after {
            return;
        }
        let pose = candidates.choose(self.camera_from_marker.as_ref());
        let filtered = FilteredPose::follow(history.pose, pose.camera_from_marker, captured, &filter, is_smoothed);
        history.pose = Some(filtered);
        self.state = MarkerState::Tracked;
        self.markers = markers;
        self.camera_from_marker = Some(filtered.pose());
        self.steady = filtered.is_steady();
        self.reprojection_error = pose.reprojection_error;
        self.last_seen = Some(detected.sequence);
        self.last_seen_at = Some(captured);
    }

    /// The marker is not in a frame.
    fn miss(&mut self, captured: Duration, history: &mut PoseHistory, filter: &PoseFilter) {
        let missed_for = self.last_seen_at.map(|last| captured.saturating_sub(last));
        self.state = match (self.state, missed_for) {
            (MarkerState::Tracked | MarkerState::Held, Some(time)) if time <= filter.lost_after => MarkerState::Held,
            (_, Some(_)) => MarkerState::Lost,
            (_, None) => MarkerState::Searching,
        };
        if self.state != MarkerState::Held {
            history.first_seen = None;
        }
    }
}

#[derive(QueryData)]
pub(super) struct PosedAnchor {
    entity: Entity,
    anchor: &'static MarkerAnchor,
    views: &'static MarkerViews,
    filter: &'static PoseFilter,
    histories: &'static PoseHistories,
    is_origin: Has<WorldOrigin>,
}

impl PosedAnchorItem<'_, '_> {
    /// Pose in the newest frame of a camera, or at the moment if the filter predicts.
    fn camera_from_marker(&self, camera: Entity, now: Duration) -> Option<Isometry3d> {
        let view = self.views.get(camera)?;
        let pose = self.histories.get(camera).and_then(|history| history.pose);
        match pose.filter(|_| self.filter.predict && view.state == MarkerState::Tracked) {
            Some(pose) => Some(pose.predicted(now)),
            None => view.camera_from_marker,
        }
    }
}

/// Camera of which frames were searched.
#[derive(QueryData)]
pub(super) struct SearchedCamera {
    entity: Entity,
    camera: &'static Camera,
    ar_camera: &'static ArCamera,
    frame: &'static CameraFrame,
}

/// Moves each camera to where its frames show the origin of the world, and the other anchors to where the cameras see
/// them.
pub(super) fn apply_poses(
    mut commands: Commands,
    cameras: Query<SearchedCamera, With<DetectedMarkers>>,
    anchors: Query<PosedAnchor>,
    placement: Placement,
    time: Option<Res<Time<Real>>>,
) {
    let now = time.map_or(Duration::ZERO, |time| time.elapsed());
    let mut sorted: Vec<_> = cameras.iter().collect();
    sorted.sort_by_key(|camera| camera_rank(camera.entity, camera.camera));
    let mut origins: Vec<_> = anchors.iter().filter(|anchor| anchor.is_origin).collect();
    origins.sort_by_key(|anchor| anchor.entity);
    if origins.len() > 1 {
        warn_once!("{} anchors have WorldOrigin; only {} is the origin of the world", origins.len(), origins[0].entity);
    }
    let mut moved = EntityHashMap::default();
    if let Some(origin) = origins.first()
        && let Some(world_from_origin) = placement.world_from(origin.entity)
    {
        for camera in sorted.iter().map(|camera| camera.entity) {
            if let Some(pose) = origin.camera_from_marker(camera, now) {
                let world_from_camera = world_from_origin * pose.inverse();
                placement.place(&mut commands, camera, world_from_camera);
                moved.insert(camera, world_from_camera);
            }
        }
        // Anchors are placed by cameras whose pose is known, if any of these sees them.
        sorted.sort_by_key(|camera| !moved.contains_key(&camera.entity));
    }
    let origin = origins.first().map(|origin| origin.entity);
    for anchor in anchors.iter().filter(|anchor| Some(anchor.entity) != origin) {
        let sighting = |of: &SearchedCameraItem| {
            let view = anchor.views.get(of.entity).filter(|view| view.state == MarkerState::Tracked)?;
            Some(Sighting {
                world_from_camera: moved.get(&of.entity).copied().or_else(|| placement.world_from(of.entity))?,
                camera_from_marker: anchor.camera_from_marker(of.entity, now)?,
                focal: of.ar_camera.intrinsics_for(of.frame).focal.x,
                captured: view.last_seen_at?,
            })
        };
        let (known, other) = sorted.split_at(moved.len());
        let mut sightings: Vec<_> = known.iter().filter_map(sighting).collect();
        if sightings.is_empty() {
            sightings.extend(other.iter().filter_map(sighting));
        }
        if let Some(pose) = triangulate(&sightings, anchor.anchor.size) {
            placement.place(&mut commands, anchor.entity, pose);
        }
    }
}
