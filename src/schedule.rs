//! The order of the stages within a frame.

use bevy::prelude::*;

/// The order of this crate's work within one frame.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MirrorballSystems {
    /// `PreUpdate`: the newest camera frame is taken in ([`camera`](crate::camera)).
    Poll,
    /// `PreUpdate`, after [`Poll`](Self::Poll): markers are found, the camera or the anchors move ([`tracking`](crate::tracking)).
    Track,
    /// `PostUpdate`, after transforms are propagated: what depends on poses is computed ([`probe`](crate::probe)).
    Measure,
    /// `PostUpdate`, after [`Measure`](Self::Measure): what the camera clipped is recovered and lights are found ([`lighting`](crate::lighting)).
    Light,
    /// `PostUpdate`, after [`Light`](Self::Light): the dome and its key lights follow casters and lights ([`shadows`](crate::shadows)).
    Shade,
}

/// Points in the render graph that other passes can order themselves by.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum MirrorballPasses {
    /// Environment cubes have been written for this frame once this set is done ([`probe`](crate::probe)).
    WriteCubes,
}

/// Puts the sets of a frame in order. Every plugin that uses one does this, so that each can be used alone.
pub(crate) fn configure(app: &mut App) {
    app.configure_sets(PreUpdate, (MirrorballSystems::Poll, MirrorballSystems::Track).chain()).configure_sets(
        PostUpdate,
        (MirrorballSystems::Measure, MirrorballSystems::Light, MirrorballSystems::Shade)
            .chain()
            .after(TransformSystems::Propagate),
    );
}
