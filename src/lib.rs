//! Live, measured light from the real world for Bevy.

pub mod authoring;
pub mod camera;
pub mod environment;
pub mod materials;
pub mod offscreen;
pub mod probe;
pub mod shadows;
pub mod stage;
pub mod tracking;

use bevy::{app::PluginGroupBuilder, prelude::*};

/// All of the crate. Add after [`DefaultPlugins`].
///
/// | plugin | does |
/// |---|---|
/// | [`camera::CameraPlugin`] | takes camera pictures in, shows them, projects like the real camera |
/// | [`tracking::TrackingPlugin`] | finds markers, moves the camera or the anchors |
/// | [`stage::StagePlugin`] | tells real from virtual |
/// | [`probe::ProbePlugin`] | mirrored ball → environment cube |
/// | [`environment::EnvironmentPlugin`] | environment cube → light on every `StandardMaterial` |
/// | [`shadows::ShadowsPlugin`] | dome of shadow directions |
/// | [`materials::MaterialsPlugin`] | phantoms, image-based surfaces |
/// | [`authoring::AuthoringPlugin`] | glTF extras → components |
///
/// Each can be used alone or left out with [`PluginGroupBuilder::disable`].
#[derive(Default)]
pub struct MirrorballPlugins;

impl PluginGroup for MirrorballPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(camera::CameraPlugin)
            .add(tracking::TrackingPlugin)
            .add(stage::StagePlugin)
            .add(probe::ProbePlugin)
            .add(environment::EnvironmentPlugin)
            .add(shadows::ShadowsPlugin)
            .add(materials::MaterialsPlugin)
            .add(authoring::AuthoringPlugin)
    }
}

/// The order of this crate's work within one frame.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MirrorballSystems {
    /// `PreUpdate`: the newest camera frame is taken in ([`camera`]).
    Poll,
    /// `PreUpdate`, after [`Poll`](Self::Poll): markers are found, the camera or the anchors move ([`tracking`]).
    Track,
    /// `PostUpdate`, after transforms are propagated: what depends on poses is computed.
    Measure,
}

/// Points in the render graph that other passes can order themselves by.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MirrorballPasses {
    /// Environment cubes have been written for this frame once this set is done ([`probe`]).
    WriteCubes,
}

/// What most games import.
pub mod prelude {
    pub use crate::{
        MirrorballPlugins,
        camera::{ArCamera, CameraFeed, CameraFrame, FrameFit, Intrinsics},
        environment::LiveEnvironment,
        materials::SurfaceStyle,
        probe::LightProbeSphere,
        shadows::ShadowDomeLight,
        stage::PhantomObject,
        tracking::{MarkerAnchor, WorldOrigin},
    };
}
