//! What is seen of a place, read before anything is drawn: its view, and its sky.

use super::{
    Place,
    lamps::Sun,
    room::{self, LitByRoom},
    sky,
    view_point::{DesignFieldOfView, ViewPoint},
};
use crate::support::{Outcome, asset_path};
use bevy::{
    camera::{Exposure, Hdr},
    core_pipeline::tonemapping::Tonemapping,
    light::Skybox,
    prelude::*,
    render::view::{ColorGrading, ColorGradingGlobal},
};
use bevy_mirrorball::{
    environment_map::{EnvironmentCube, EquirectPixels},
    prelude::*,
};

/// Edge of the cube that is the background, in texels.
const BACKGROUND: u32 = 256;
/// Radiance of the brightest cloud, in frame buffer units. What is brighter is the sun.
const MAX_CLOUD: f32 = 3.0;

/// One frame buffer unit is 154 cd/m², for which the spot lights of the files are made.
const EXPOSURE: Exposure = Exposure::INDOOR;
/// Distances in meters of the place between which things are drawn.
const NEAR: f32 = 0.1;
const FAR: f32 = 1000.0;
/// Brightening of the evening, in stops: tone mapping leaves its middle tones dark.
const STOPS: f32 = 0.8;

/// A place that can be shown.
pub(crate) struct Scenery {
    place: Place,
    view: ViewPoint,
    sky: EquirectPixels,
}

impl Scenery {
    /// Reads view and sky of a place.
    pub(crate) fn open(place: Place) -> Outcome<Self> {
        let sky = match place {
            Place::Stonehenge => EquirectPixels::open(asset_path("scenes/stonehenge_sky.hdr"))?,
            Place::Campus => sky::gradient(),
        };
        Ok(Self { place, view: ViewPoint::open(&place.file(), place.name())?, sky })
    }

    /// Spawns the camera, its sky as light, and the sun. The camera draws to the window unless it gets another target.
    pub(crate) fn spawn_camera(&self, world: &mut World) -> Entity {
        let light = sky::without_sun(&self.sky, MAX_CLOUD).to_cube(EnvironmentCube::SIZE, Quat::IDENTITY).to_image();
        let light = LiveEnvironment::new(world.resource_mut::<Assets<Image>>().add(light));
        world.spawn(Sun::of(self.place).lamp(self.view.sun, &EXPOSURE));
        let camera = self.spawn_unlit_camera(world, Transform::IDENTITY);
        world.entity_mut(camera).insert(light.with_refresh(Refresh::OnChange));
        camera
    }

    /// The same as a model on the desk of a room, which lights it instead of sky and sun (see [`room`]).
    pub(crate) fn spawn_camera_in_room(&self, world: &mut World) -> Entity {
        let camera = self.spawn_unlit_camera(world, room::DESK_FROM_PLACE);
        world.entity_mut(camera).insert(LitByRoom);
        camera
    }

    fn spawn_unlit_camera(&self, world: &mut World, world_from_place: Transform) -> Entity {
        let background = self.sky.to_cube(BACKGROUND, Quat::IDENTITY).to_image();
        let background = world.resource_mut::<Assets<Image>>().add(background);
        let scale = world_from_place.scale.x;
        let lens =
            PerspectiveProjection { fov: self.view.field_of_view, near: NEAR * scale, far: FAR * scale, ..default() };
        let camera = (
            Camera3d::default(),
            Transform { scale: Vec3::ONE, ..world_from_place * self.view.camera },
            Projection::from(lens),
            DesignFieldOfView(self.view.field_of_view),
            AmbientLight { brightness: 0.0, ..default() },
            EXPOSURE,
            Skybox { image: Some(background), brightness: 1.0 / EXPOSURE.exposure(), ..default() },
        );
        let camera = world.spawn(camera).id();
        match self.place {
            // Bright clouds and edges in the sun keep their colors.
            Place::Stonehenge => world.entity_mut(camera).insert((Hdr, Tonemapping::AcesFitted, brightened(STOPS))),
            Place::Campus => world.entity_mut(camera).insert(Tonemapping::None),
        };
        camera
    }
}

fn brightened(stops: f32) -> ColorGrading {
    ColorGrading { global: ColorGradingGlobal { exposure: stops, ..default() }, ..default() }
}
