//! What is behind the game: a real desk as a camera sees it, or a place of its own, which a room may light that a
//! camera measures.
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
    Desk(RealCamera),
    /// The camera measures the room that lights the place, if there is one.
    Place(Scenery, Option<RealCamera>),
}

/// A camera in the real world.
pub(crate) struct RealCamera {
    camera: ArCamera,
    feed: CameraFeed,
    size: UVec2,
}

impl View {
    /// Checks that what is shown exists. The feed is not opened yet.
    pub(crate) fn open(options: &Options, pace: FeedPace) -> Outcome<Self> {
        Ok(match options.place {
            None => Self::Desk(RealCamera::open(options, pace)?),
            Some(place) => {
                let room = options.has_room().then(|| RealCamera::open(options, pace)).transpose()?;
                Self::Place(Scenery::open(place)?, room)
            }
        })
    }

    /// The camera in the real world.
    fn real_camera(&self) -> Option<&RealCamera> {
        match self {
            Self::Desk(camera) => Some(camera),
            Self::Place(_, room) => room.as_ref(),
        }
    }

    /// Size of its pictures in pixels.
    pub(crate) fn size(&self) -> UVec2 {
        match self {
            Self::Desk(camera) => camera.size,
            Self::Place(..) => PLACE_SIZE,
        }
    }

    /// Spawns the camera over whose picture the game is shown. It draws to the window unless it gets another target.
    pub(crate) fn spawn_camera(&self, world: &mut World) -> Entity {
        let camera = match self {
            Self::Desk(camera) => world.spawn(camera.bundle()).id(),
            Self::Place(scenery, None) => scenery.spawn_camera(world),
            Self::Place(scenery, Some(room)) => {
                // It measures without drawing.
                world.spawn((room.bundle(), Camera { is_active: false, ..default() }));
                scenery.spawn_camera_in_room(world)
            }
        };
        world.entity_mut(camera).insert((IsDefaultUiCamera, ShadowLodOrigin));
        camera
    }

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
    fn open(options: &Options, pace: FeedPace) -> Outcome<Self> {
        let (feed, size) = options.camera_feed()?;
        let camera = ArCamera { intrinsics: options.intrinsics(size), ..default() };
        Ok(Self { camera, feed: feed.with_pace(pace), size })
    }

    fn bundle(&self) -> impl Bundle {
        (self.camera.clone(), self.feed.clone())
    }

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
