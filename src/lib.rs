//! Live, measured light from the real world for Bevy.

pub mod authoring;
pub mod camera;
pub mod offscreen;
pub mod environment;
pub mod materials;
pub mod probe;
pub mod shadows;
pub mod stage;
pub mod tracking;

use bevy::prelude::*;

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
        camera::{ArCamera, CameraFeed, CameraFrame, FrameFit, Intrinsics},
        probe::LightProbeSphere,
        shadows::ShadowDomeLight,
        stage::PhantomObject,
        tracking::{MarkerAnchor, WorldOrigin},
    };
}
