//! How the measuring goes: figures for any game to read, and a panel that shows them.
//!
//! **Enters:** what the other stages leave on their entities. **Leaves:** Bevy [diagnostics](bevy::diagnostic) under the paths
//! below, a [`Checklist`] for new users, pictures of all maps that light the scene ([`MapView`]) and, with the feature `egui`, a panel
//! that shows all of it and switches styles.
//!
//! | path | unit | meaning |
//! |---|---|---|
//! | [`CAPTURE_RATE`] | pictures/s | what the source delivers at its usual exposure, dropped pictures included |
//! | [`DROPPED`] | pictures | never seen by the game, since the feed was added |
//! | [`DECODE`] | ms | file or camera bytes → pixels; in the background |
//! | [`DETECT`] | ms | search for markers; in the background for live feeds |
//! | [`MEASURE`] | ms | ball and paper, on the main thread |
//! | [`RECOVER`] | ms | clipped light and lights; in the background for live feeds |
//! | [`BALL_ERROR`] | % | root mean square difference of a virtual ball from the real one, of the sRGB range |
//! | [`KEY_LIGHT_ANGLE`] | ° | between the strongest light and its picture in the real ball |
//! | [`LIGHTING_AGE`] | ms | from the capture of a picture until the GPU has finished the frame lit by it |
//!
//! One value per new picture; those of the first [`ArCamera`](crate::camera::ArCamera). The passes on the GPU (ball → cube,
//! filter, shadow maps, weights, background) are measured by Bevy once a game adds
//! [`RenderDiagnosticsPlugin`](bevy::render::diagnostic::RenderDiagnosticsPlugin); their paths begin with `render/mirrorball_`. [`device_memory`]
//! tells what the crate's textures and buffers take up there.

mod checklist;
mod diagnostics;
mod map_view;
mod memory;
#[cfg(feature = "egui")]
mod panel;

pub use checklist::{Check, CheckLevel, Checklist};
pub use diagnostics::{
    BALL_ERROR, CAPTURE_RATE, DECODE, DETECT, DROPPED, KEY_LIGHT_ANGLE, LIGHTING_AGE, MEASURE,
    MirrorballDiagnosticsPlugin, RECOVER,
};
pub use map_view::{MapView, MapViewPlugin, ShownMap};
pub use memory::{DeviceMemory, device_memory};
#[cfg(feature = "egui")]
pub use panel::{MirrorballPanel, MirrorballPanelPlugin};

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
