//! The order of the stages within a frame.

use bevy::{
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        RenderApp,
        renderer::{RenderGraph, RenderGraphSystems},
    },
};

/// Stages of one frame, in this order.
///
/// Deferred commands of a stage are applied before the next one runs.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MirrorballSystems {
    /// `PreUpdate`: feeds are opened and the newest frame of each is taken in ([`camera`](crate::camera)). Where markers are tracked,
    /// the frame waits for its pose.
    Poll,
    /// `PreUpdate`: markers are detected, the camera or the anchors move, the frame that they were seen in is let through
    /// ([`tracking`](crate::tracking)).
    Track,
    /// `PreUpdate`: textures and projections follow the frame that is shown ([`camera`](crate::camera)).
    Show,
    /// `PreUpdate`: new probes and cameras get the environment cube ([`probe`](crate::probe)).
    Allocate,
    /// `PreUpdate`: maps and lights follow the sources of environments ([`prefilter`](crate::prefilter)).
    Follow,
    /// `PostUpdate`: meshes learn whether they are phantoms ([`phantom`](crate::phantom)).
    Assign,
    /// `PostUpdate`: materials follow roles and styles ([`materials`](crate::materials)). They read no light here, and what they spawn
    /// has to be there before Bevy looks for visible things and changed assets; so they come first.
    Dress,
    /// `PostUpdate`, after transforms are propagated: what depends on poses is measured ([`probe`](crate::probe)).
    Measure,
    /// `PostUpdate`: what the camera clipped is recovered, lights are detected and tracked ([`lighting`](crate::lighting)).
    Light,
    /// `PostUpdate`: the dome and its key lights follow casters and lights ([`shadows`](crate::shadows)).
    Shade,
}

/// Points in the render graph that other passes can order themselves by, in this order. All come before the cameras' own passes.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MirrorballPasses {
    /// Environment cubes are written ([`unwrap`](crate::unwrap)).
    WriteCubes,
    /// What reads environment cubes: maps are filtered ([`prefilter`](crate::prefilter)), directions are weighed
    /// ([`shadows`](crate::shadows)).
    ReadCubes,
}

/// Puts the sets of a frame in order. Every plugin that uses one does this, so that each can be used alone.
pub(crate) fn configure(app: &mut App) {
    use MirrorballSystems::{Allocate, Assign, Dress, Follow, Light, Measure, Poll, Shade, Show, Track};
    app.configure_sets(PreUpdate, (Poll, Track, Show, Allocate, Follow).chain())
        .configure_sets(PostUpdate, (Assign, Dress, Measure, Light, Shade).chain())
        .configure_sets(PostUpdate, (Measure, Light, Shade).after(TransformSystems::Propagate));
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        let passes = (MirrorballPasses::WriteCubes, MirrorballPasses::ReadCubes).chain();
        render_app.configure_sets(RenderGraph, passes.in_set(RenderGraphSystems::Render).before(camera_driver));
    }
}
