//! Systems that open feeds and receive their frames.
//!
//! A frame takes one of two ways. Without tracking, or in lockstep, it becomes the [`CameraFrame`] at once. Where
//! [`FramesAwaitTracking`] exists, a live frame becomes an [`ArrivingFrame`], which tracking replaces by a
//! [`CameraFrame`] when the markers in it are detected. Frames of the first way are undistorted here, those of the
//! second by tracking. Bracketed frames of live feeds are undistorted in the background.

use super::{
    ArCamera, BracketedFrame, BracketedFrames, CameraFeed, CameraFrame, FeedPace, FeedState, FeedStatistics,
    clip::SidecarTracking,
    clip_asset::{AwaitsClip, LoadedClips},
    image_feed::{ImageReader, ImageSlot},
    open_feed::{OpenFeed, open},
    source::SourceFrame,
    texture_limit::ReportedSizes,
    undistort::UndistortionMaps,
};
use crate::frame_tasks::spawn_for_frame;
use bevy::{
    ecs::observer::On,
    prelude::*,
    render::renderer::RenderDevice,
    tasks::{Task, futures::check_ready},
};
use std::collections::VecDeque;

/// Marks apps in which live frames become [`CameraFrame`]s only after marker detection. Inserted by
/// [`tracking`](crate::tracking).
#[derive(Resource, Default)]
pub(crate) struct FramesAwaitTracking;

/// A live frame that waits for marker detection, as the lens shows it. Removed by [`tracking`](crate::tracking).
#[derive(Component)]
pub(crate) struct ArrivingFrame(pub(crate) CameraFrame);

type ChangedFeed = (Entity, &'static CameraFeed, &'static mut FeedState, Option<&'static Children>);

/// Bracketed frames that are being undistorted, in the order in which they were taken.
#[derive(Component, Default)]
pub(super) struct UndistortingBrackets(VecDeque<Task<BracketedFrame>>);

pub(super) fn open_feeds(
    mut commands: Commands,
    mut feeds: Query<ChangedFeed, Or<(Changed<CameraFeed>, With<AwaitsClip>)>>,
    clips: LoadedClips,
    readers: Query<(), With<ImageReader>>,
) {
    for (camera, feed, mut state, children) in &mut feeds {
        commands.entity(camera).remove::<(OpenFeed, ImageSlot, SidecarTracking, UndistortingBrackets, AwaitsClip)>();
        for reader in children.into_iter().flatten().filter(|child| readers.contains(**child)) {
            commands.entity(*reader).despawn();
        }
        match open(feed, &clips) {
            Ok(None) => {
                commands.entity(camera).insert(AwaitsClip);
                state.set_if_neq(FeedState::Waiting);
            }
            Ok(Some((source, slot))) => {
                if let Some(tracking) = source.0.tracking() {
                    commands.entity(camera).insert(SidecarTracking(tracking.clone()));
                }
                commands.entity(camera).insert(source);
                if let Some(slot) = slot {
                    commands.entity(camera).insert(slot);
                }
                state.set_if_neq(FeedState::Waiting);
            }
            Err(error) => report_state(camera, &mut state, FeedState::Failed(error.to_string())),
        }
    }
}

/// Closes the source of a feed that is taken away.
pub(super) fn close_feed(
    removed: On<Remove, CameraFeed>,
    mut commands: Commands,
    children: Query<&Children>,
    readers: Query<(), With<ImageReader>>,
) {
    for reader in children.get(removed.entity).into_iter().flatten().filter(|child| readers.contains(**child)) {
        commands.entity(*reader).try_despawn();
    }
    if let Ok(mut camera) = commands.get_entity(removed.entity) {
        camera.try_remove::<(OpenFeed, ImageSlot, SidecarTracking, ArrivingFrame, UndistortingBrackets, AwaitsClip)>();
    }
}

/// Changes the state of a feed and logs changes that concern the user.
fn report_state(camera: Entity, state: &mut Mut<FeedState>, new: FeedState) {
    if !state.set_if_neq(new) {
        return;
    }
    match &**state {
        FeedState::Failed(reason) => error!("camera {camera}: {reason}"),
        FeedState::Lost(reason) => warn!("camera {camera}: {reason}"),
        FeedState::Playing => debug!("camera {camera}: frames arrive"),
        FeedState::Waiting => {}
    }
}

type PolledFeed = (
    Entity,
    &'static CameraFeed,
    &'static mut OpenFeed,
    &'static mut FeedState,
    &'static mut FeedStatistics,
    Option<&'static ArCamera>,
    Has<ArrivingFrame>,
);

pub(super) fn poll_feeds(
    mut commands: Commands,
    mut feeds: Query<PolledFeed>,
    time: Res<Time<Real>>,
    awaits_tracking: Option<Res<FramesAwaitTracking>>,
    device: Option<Res<RenderDevice>>,
    mut reported: ResMut<ReportedSizes>,
    maps: Res<UndistortionMaps>,
) {
    for (camera, feed, mut open, mut state, mut statistics, ar_camera, is_one_arriving) in &mut feeds {
        let mut arrival = open.0.poll(time.elapsed());
        if feed.exposure < 1.0 {
            arrival.bracketed.extend(arrival.frame.take());
        }
        if arrival.dropped > 0 {
            statistics.dropped += arrival.dropped;
        }
        if let Some(new) = arrival.state {
            report_state(camera, &mut state, new);
        }
        if arrival.frame.is_some() || !arrival.bracketed.is_empty() {
            report_state(camera, &mut state, FeedState::Playing);
        }
        for frame in arrival.frame.iter_mut().chain(&mut arrival.bracketed) {
            reported.limit(camera, &mut frame.pixels, device.as_deref());
        }
        let lens_of = |frame: &SourceFrame| ar_camera?.distorting_lens(frame.intrinsics, frame.pixels.size);
        for frame in arrival.bracketed {
            statistics.bracketed += 1;
            let lens = lens_of(&frame);
            let SourceFrame { pixels, captured, exposure, .. } = frame;
            let mut frame = BracketedFrame { pixels, exposure: exposure * feed.exposure, captured };
            if lens.is_some() && feed.pace == FeedPace::Live {
                let maps = maps.clone();
                let undistort = async move {
                    maps.undistort(&mut frame.pixels, lens.as_ref());
                    frame
                };
                let task = spawn_for_frame(undistort);
                let add = move |mut waiting: Mut<UndistortingBrackets>| waiting.0.push_back(task);
                commands.entity(camera).entry::<UndistortingBrackets>().or_default().and_modify(add);
            } else {
                maps.undistort(&mut frame.pixels, lens.as_ref());
                keep_bracketed(&mut commands.entity(camera), frame);
            }
        }
        let Some(mut source_frame) = arrival.frame else {
            continue;
        };
        let awaits_tracking = awaits_tracking.is_some() && feed.pace == FeedPace::Live;
        if !awaits_tracking {
            let lens = lens_of(&source_frame);
            maps.undistort(&mut source_frame.pixels, lens.as_ref());
        }
        statistics.note_frame(arrival.dropped, source_frame.captured, source_frame.decode_time);
        let frame = CameraFrame {
            pixels: source_frame.pixels,
            sequence: statistics.frames,
            captured: source_frame.captured,
            intrinsics: source_frame.intrinsics,
        };
        if awaits_tracking {
            // The newest frame replaces the one that still waits, which will never be seen.
            statistics.dropped += u64::from(is_one_arriving);
            commands.entity(camera).insert(ArrivingFrame(frame));
        } else {
            commands.entity(camera).insert(frame);
        }
    }
}

/// Keeps bracketed frames that are undistorted now.
pub(super) fn keep_undistorted_brackets(
    mut commands: Commands,
    mut cameras: Query<(Entity, &mut UndistortingBrackets)>,
) {
    for (camera, mut brackets) in &mut cameras {
        while let Some(frame) = brackets.0.front_mut().and_then(check_ready) {
            brackets.0.pop_front();
            keep_bracketed(&mut commands.entity(camera), frame);
        }
    }
}

fn keep_bracketed(camera: &mut EntityCommands, frame: BracketedFrame) {
    camera.entry::<BracketedFrames>().or_default().and_modify(move |mut frames| frames.insert(frame));
}
