//! What is behind the game: a real desk as a camera sees it, or a place of its own, which a room may light that a
//! camera measures.
//!
//! The command line enters, an entity with the camera that draws leaves. Nothing else of the program knows which of the
//! two it is.

use crate::{options::Options, places::Scenery, support::Outcome};
use bevy::{camera::ShadowLodOrigin, prelude::*, ui::IsDefaultUiCamera};
use bevy_mirrorball::prelude::*;

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
    pub feed: CameraFeed,
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
    pub(crate) fn real_camera(&self) -> Option<&RealCamera> {
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
}
