//! When a view can be drawn without a window: whether its scene and its light are there.

use crate::{
    places::PlaceRoot,
    support::Outcome,
    view::{RealCamera, View},
};
use bevy::{animation::AnimationPlayer, prelude::*};
use bevy_mirrorball::{
    camera::FeedState, environment_map::EnvironmentCube, headless, prelude::*, probe::ProbeMeasurement,
};

impl View {
    /// Returns whether the scene is spawned.
    pub(crate) fn has_scene(&self, world: &mut World) -> bool {
        match self {
            Self::Desk(_) => world.query::<&MarkerAnchor>().iter(world).next().is_some(),
            Self::Place(..) => {
                let has_root = world.query_filtered::<(), (With<PlaceRoot>, With<Children>)>().iter(world).next();
                let has_dancer = world.query::<&AnimationPlayer>().iter(world).next();
                has_root.is_some() && has_dancer.is_some()
            }
        }
    }

    /// What is probably wrong where the scene is loaded and never spawned.
    pub(crate) fn lack(&self) -> &'static str {
        match self {
            Self::Desk(_) => "no node of it has the extras MarkerAnchor",
            Self::Place(..) => "the dancer's file has no animations",
        }
    }

    /// Returns whether a frame has arrived and, if its ball is visible, its light.
    pub(crate) fn is_lit(&self, app: &mut App) -> Outcome<bool> {
        if self.real_camera().is_some() && !RealCamera::is_lit(app)? {
            return Ok(false);
        }
        if let Self::Place(..) = self {
            // The light of a place comes with the shaders that filter it.
            headless::settle(app)?;
        }
        Ok(true)
    }

    /// Starts with the first frame of the feed again.
    pub(crate) fn restart(&self, world: &mut World) {
        let Some(RealCamera { feed, .. }) = self.real_camera() else { return };
        for camera in world.query_filtered::<Entity, With<ArCamera>>().iter(world).collect::<Vec<_>>() {
            world.entity_mut(camera).insert(feed.clone());
        }
    }
}

impl RealCamera {
    /// Returns whether a frame has arrived and, if its ball is visible, its light.
    fn is_lit(app: &mut App) -> Outcome<bool> {
        let world = app.world_mut();
        let state = world.query::<&FeedState>().iter(world).next().cloned().unwrap_or_default();
        if let FeedState::Failed(reason) = state {
            return Err(reason.into());
        }
        if world.query::<&CameraFrame>().iter(world).next().is_none() {
            return Ok(false);
        }
        let sees_ball = world.query::<&ProbeMeasurement>().iter(world).any(|probe| probe.is_in_view);
        let cube = world.query::<&EnvironmentCube>().iter(world).next().map(|cube| cube.0.clone());
        Ok(match cube {
            Some(cube) if sees_ball => headless::read_texture(app, &cube)?.iter().any(|byte| *byte != 0),
            _ => true,
        })
    }
}
