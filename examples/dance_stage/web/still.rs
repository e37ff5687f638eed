//! One frame of the clip, shown as `--headless` draws it: the clip starts again when everything is loaded, and all
//! stands still after the frame. The page then costs nothing until something is switched.

use super::{CLIP, is_lit, pipelines::LoadingPipelines};
use crate::{dancer::Dance, game::Screen, support::has_loaded};
use bevy::{
    animation::AnimationPlayer,
    prelude::*,
    time::TimeUpdateStrategy,
    winit::{UpdateMode, WinitSettings},
};
use bevy_mirrorball::{prefilter::EnvironmentState, prelude::*};
use std::time::Duration;

/// Successive updates without loading shaders after which none is to come.
const MIN_QUIET_UPDATES: u32 = 4;
/// Time from picture to picture without a window.
const STEP: Duration = Duration::from_nanos(1_000_000_000 / 15);

/// The frame that is shown, and how far it is.
#[derive(Resource, Clone, Copy)]
pub(super) struct Still {
    frame: u32,
    stage: Stage,
}

#[derive(Clone, Copy, PartialEq)]
enum Stage {
    /// Updates in which nothing was loading.
    Loading(u32),
    /// Frames of the clip since it was started again.
    Playing(u32),
    /// The same as while loading, for what was switched.
    Changing(u32),
    Shown,
}

impl Still {
    pub(super) fn new(frame: u32) -> Self {
        Self { frame, stage: Stage::Loading(0) }
    }

    pub(super) fn is_shown(&self) -> bool {
        self.stage == Stage::Shown
    }
}

/// The clip, of which no frame is skipped.
pub(super) fn feed(assets: &AssetServer) -> CameraFeed {
    CameraFeed::clip_asset(assets.load(CLIP)).with_pace(FeedPace::Lockstep)
}

/// Goes from stage to stage.
pub(super) fn advance(world: &mut World) {
    let Some(Still { frame, stage }) = world.get_resource().copied() else { return };
    let next = match stage {
        Stage::Loading(MIN_QUIET_UPDATES..) => {
            // The recording starts with the first frame of the feed and the first beat.
            world.insert_resource(TimeUpdateStrategy::ManualDuration(STEP));
            world.insert_resource(Dance::default());
            let feed = feed(world.resource());
            give_all(world, &feed);
            Stage::Playing(0)
        }
        Stage::Loading(quiet) => {
            // The title is a window's.
            world.resource_mut::<NextState<Screen>>().set(Screen::Rehearsal);
            Stage::Loading(if is_ready(world) { quiet + 1 } else { 0 })
        }
        Stage::Playing(shown) if shown >= frame => {
            world.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::ZERO));
            give_all(world, &CameraFeed::default());
            rest(world)
        }
        Stage::Playing(shown) => Stage::Playing(shown + 1),
        Stage::Changing(MIN_QUIET_UPDATES..) => rest(world),
        Stage::Changing(quiet) => Stage::Changing(if is_ready(world) { quiet + 1 } else { 0 }),
        Stage::Shown if has_switched(world) => {
            world.insert_resource(WinitSettings::continuous());
            Stage::Changing(0)
        }
        Stage::Shown => Stage::Shown,
    };
    world.resource_mut::<Still>().stage = next;
}

/// Whether scene, dancer, light and shaders are there.
fn is_ready(world: &mut World) -> bool {
    let is_lit = world.query_filtered::<&EnvironmentState, With<ArCamera>>().iter(world).any(is_lit);
    let has_scene = world.query::<&MarkerAnchor>().iter(world).next().is_some();
    let has_dancer = world.query::<&AnimationPlayer>().iter(world).next().is_some();
    is_lit && has_scene && has_dancer && has_loaded(world) && !world.resource::<LoadingPipelines>().any()
}

/// Whether a thing has got another style.
fn has_switched(world: &mut World) -> bool {
    world.query::<Ref<SurfaceStyle>>().iter(world).any(|style| style.is_changed())
}

/// Draws nothing more until someone presses a key.
fn rest(world: &mut World) -> Stage {
    let mode = UpdateMode::reactive_low_power(Duration::from_secs(24 * 60 * 60));
    world.insert_resource(WinitSettings { focused_mode: mode, unfocused_mode: mode });
    Stage::Shown
}

/// Gives all cameras another feed.
fn give_all(world: &mut World, feed: &CameraFeed) {
    for camera in world.query_filtered::<Entity, With<ArCamera>>().iter(world).collect::<Vec<_>>() {
        world.entity_mut(camera).insert(feed.clone());
    }
}
