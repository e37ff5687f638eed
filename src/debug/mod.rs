//! Diagnostics of the measurement, and a panel that shows them.
//!
//! **Enters:** the results that the other stages leave on their entities. **Leaves:** Bevy
//! [diagnostics](bevy::diagnostic) under the paths below, a [`Checklist`] for new users, images of all maps that
//! light the scene ([`MapView`]), lines in the picture that show markers, balls, lights, the dome and phantoms
//! ([`MirrorballGizmos`], off by default) and, with the feature `egui`, a panel that shows all of it and switches
//! styles.
//!
//! | path | unit | meaning |
//! |---|---|---|
//! | [`CAPTURE_RATE`] | frames/s | frames that the source delivers at its usual exposure, dropped frames included |
//! | [`DROPPED`] | frames | frames that the game never received, since the feed was added |
//! | [`DECODE`] | ms | decoding of file or camera bytes to pixels; in the background |
//! | [`DETECT`] | ms | marker detection; in the background for live feeds |
//! | [`MEASURE`] | ms | measurement of ball and paper, on the main thread |
//! | [`RECOVER`] | ms | recovery of clipped light and lights; in the background for live feeds |
//! | [`BALL_ERROR`] | % | root mean square difference between a virtual ball and the real one, of the sRGB range |
//! | [`KEY_LIGHT_ANGLE`] | ° | angle between the strongest light and its image in the real ball |
//! | [`LIGHTING_AGE`] | ms | time from the capture of a camera frame until the GPU has finished the render lit by it |
//! | [`MAIN_THREAD`] | ms | what the stages of this crate take of an update, and what runs beside them |
//!
//! There is one value per new camera frame (of [`MAIN_THREAD`]: per update), for the first
//! [`ArCamera`](crate::camera::ArCamera). Bevy measures the passes on the GPU (ball → cube, filter, shadow maps,
//! weights, background) once a game adds
//! [`RenderDiagnosticsPlugin`](bevy::render::diagnostic::RenderDiagnosticsPlugin); their paths begin with
//! `render/mirrorball_`. [`device_memory`] reports the GPU memory of the crate's textures and buffers.

mod checklist;
mod diagnostics;
mod gizmos;
mod main_thread;
mod map_view;
mod memory;
#[cfg(feature = "egui")]
mod panel;

pub use checklist::{Check, CheckLevel, Checklist};
pub use diagnostics::{
    BALL_ERROR, CAPTURE_RATE, DECODE, DETECT, DROPPED, KEY_LIGHT_ANGLE, LIGHTING_AGE, MAIN_THREAD, MEASURE,
    MirrorballDiagnosticsPlugin, RECOVER,
};
pub use gizmos::{MirrorballGizmos, MirrorballGizmosPlugin};
pub use map_view::{MapView, MapViewPlugin, ShownMap};
pub use memory::{DeviceMemory, device_memory};
#[cfg(feature = "egui")]
pub use panel::{MirrorballPanel, MirrorballPanelPlugin, edit_surface_style};

/// Old name of [`MirrorballDiagnosticsPlugin`].
#[deprecated(since = "0.1.0", note = "use `MirrorballDiagnosticsPlugin`")]
#[doc(hidden)]
pub type FeedDiagnosticsPlugin = MirrorballDiagnosticsPlugin;

/// Old name of [`MirrorballDiagnosticsPlugin`], as a value.
#[deprecated(since = "0.1.0", note = "use `MirrorballDiagnosticsPlugin`")]
#[doc(hidden)]
#[expect(non_upper_case_globals, reason = "the name that the unit struct had")]
pub const FeedDiagnosticsPlugin: MirrorballDiagnosticsPlugin = MirrorballDiagnosticsPlugin;

/// Old name of [`MirrorballPanel`].
#[cfg(feature = "egui")]
#[deprecated(since = "0.1.0", note = "use `MirrorballPanel`")]
#[doc(hidden)]
pub type MeasuringPanel = MirrorballPanel;

/// Old name of [`MirrorballPanelPlugin`].
#[cfg(feature = "egui")]
#[deprecated(since = "0.1.0", note = "use `MirrorballPanelPlugin`")]
#[doc(hidden)]
pub type MeasuringPanelPlugin = MirrorballPanelPlugin;

/// Old name of [`MirrorballPanelPlugin`], as a value.
#[cfg(feature = "egui")]
#[deprecated(since = "0.1.0", note = "use `MirrorballPanelPlugin`")]
#[doc(hidden)]
#[expect(non_upper_case_globals, reason = "the name that the unit struct had")]
pub const MeasuringPanelPlugin: MirrorballPanelPlugin = MirrorballPanelPlugin;
