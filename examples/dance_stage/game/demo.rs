//! Players that dance by themselves.

use super::{playback::Playback, player::Steps};
use crate::rules::DemoPlayer;
use bevy::prelude::*;

/// Plan of all steps of a player.
#[derive(Component)]
pub(crate) struct Demo(pub DemoPlayer);

pub(super) fn step_by_plan(playback: Res<Playback>, mut players: Query<(&Demo, &mut Steps)>) {
    for (demo, mut steps) in &mut players {
        steps.0.extend_from_slice(demo.0.steps(playback.before, playback.now));
    }
}
