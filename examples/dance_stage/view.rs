//! What is behind the game: a real desk as a camera sees it, or a place of its own.
//!
//! The command line enters, an entity with the camera that draws leaves. Nothing else of the program knows which of the
//! two it is.

use crate::{
    options::Options,
    places::{PlaceRoot, Scenery},
    support::Outcome,
};
use bevy::{animation::AnimationPlayer, camera::ShadowLodOrigin, prelude::*, ui::IsDefaultUiCamera};
use bevy_mirrorball::{
    camera::FeedState, environment_map::EnvironmentCube, headless, prelude::*, probe::ProbeMeasurement,
};

/// Size of pictures of places, in pixels, unless the command line says another.
const PLACE_SIZE: UVec2 = UVec2::new(640, 480);

/// What the players see behind their arrows.
pub(crate) enum View {
    Desk { camera: Box<ArCamera>, feed: CameraFeed, size: UVec2 },
    Place(Scenery),
}

impl View {
    /// Checks that what is shown exists. The feed is not opened yet.
    pub(crate) fn open(options: &Options, pace: FeedPace) -> Outcome<Self> {
        if let Some(place) = options.place {
            return Ok(Self::Place(Scenery::open(place)?));
        }
        let (feed, size) = options.camera_feed()?;
        let camera = ArCamera { intrinsics: options.intrinsics(size), ..default() };
        Ok(Self::Desk { camera: Box::new(camera), feed: feed.with_pace(pace), size })
    }

    /// Size of its pictures in pixels.
    pub(crate) fn size(&self) -> UVec2 {
        match self {
            Self::Desk { size, .. } => *size,
            Self::Place(_) => PLACE_SIZE,
        }
    }

    /// Spawns the camera over whose picture the game is shown. It draws to the window unless it gets another target.
    pub(crate) fn spawn_camera(&self, world: &mut World) -> Entity {
        let camera = match self {
            Self::Desk { camera, feed, .. } => world.spawn(((**camera).clone(), feed.clone())).id(),
            Self::Place(scenery) => scenery.spawn_camera(world),
        };
        world.entity_mut(camera).insert((IsDefaultUiCamera, ShadowLodOrigin));
        camera
    }

    /// Returns whether the scene is spawned.
    pub(crate) fn has_scene(&self, world: &mut World) -> bool {
        match self {
            Self::Desk { .. } => world.query::<&MarkerAnchor>().iter(world).next().is_some(),
            Self::Place(_) => {
                let has_root = world.query_filtered::<(), (With<PlaceRoot>, With<Children>)>().iter(world).next();
                let has_dancer = world.query::<&AnimationPlayer>().iter(world).next();
                has_root.is_some() && has_dancer.is_some()
            }
        }
    }

    /// What is probably wrong where the scene is loaded and never spawned.
    pub(crate) fn lack(&self) -> &'static str {
        match self {
            Self::Desk { .. } => "no node of it has the extras MarkerAnchor",
            Self::Place(_) => "the dancer's file has no animations",
        }
    }

    /// Returns whether a frame has arrived and, if its ball is visible, its light.
    pub(crate) fn is_lit(&self, app: &mut App) -> Outcome<bool> {
        if let Self::Place(_) = self {
            // The light of a place comes with the shaders that filter it.
            headless::settle(app)?;
            return Ok(true);
        }
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

    /// Starts with the first frame of the feed again.
    pub(crate) fn restart(&self, world: &mut World, camera: Entity) {
        if let Self::Desk { feed, .. } = self {
            world.entity_mut(camera).insert(feed.clone());
        }
    }
}
