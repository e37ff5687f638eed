//! What is seen of a place, read before anything is drawn: its view, and its sky.

use super::{
    Place,
    lamps::Sun,
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

    /// Spawns the camera and the sun. The camera draws to the window unless it gets another target.
    pub(crate) fn spawn_camera(&self, world: &mut World) -> Entity {
        // One frame buffer unit is 154 cd/m², for which the spot lights of the files are made.
        let exposure = Exposure::INDOOR;
        let cube = |sky: &EquirectPixels, edge| sky.to_cube(edge, Quat::IDENTITY).to_image();
        let (light, background) =
            (cube(&sky::without_sun(&self.sky, MAX_CLOUD), EnvironmentCube::SIZE), cube(&self.sky, BACKGROUND));
        let mut images = world.resource_mut::<Assets<Image>>();
        let (light, background) = (images.add(light), images.add(background));
        world.spawn(Sun::of(self.place).lamp(self.view.sun, &exposure));
        let skybox = Skybox { image: Some(background), brightness: 1.0 / exposure.exposure(), ..default() };
        let camera = (
            Camera3d::default(),
            self.view.camera,
            Projection::from(PerspectiveProjection { fov: self.view.field_of_view, far: 1000.0, ..default() }),
            DesignFieldOfView(self.view.field_of_view),
            AmbientLight { brightness: 0.0, ..default() },
            LiveEnvironment::new(light).with_refresh(Refresh::OnChange),
            (exposure, skybox),
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
