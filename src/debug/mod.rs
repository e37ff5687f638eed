//! How the measuring goes: figures for any game to read, and a panel that shows them.
//!
//! **Enters:** what the other stages leave on their entities. **Leaves:** Bevy [diagnostics](bevy::diagnostic) under the paths
//! below, a [`Checklist`] for new users and, with the feature `egui`, a panel that shows all of it and switches styles.
//!
//! | path | unit | meaning |
//! |---|---|---|
//! | [`CAPTURE_RATE`] | pictures/s | what the source delivers, dropped pictures included |
//! | [`DROPPED`] | pictures | never seen by the game, since the feed was added |
//! | [`DECODE`] | ms | file or camera bytes → pixels; in the background |
//! | [`DETECT`] | ms | search for markers; in the background for live feeds |
//! | [`MEASURE`] | ms | ball and paper, on the main thread |
//! | [`LIGHTING_AGE`] | ms | from the capture of a picture until the GPU has finished the frame lit by it |
//!
//! One value per new picture; those of the first [`ArCamera`](crate::camera::ArCamera). The passes on the GPU (ball → cube,
//! filter, shadow maps, weights, background) are measured by Bevy once a game adds
//! [`RenderDiagnosticsPlugin`](bevy::render::diagnostic::RenderDiagnosticsPlugin); their paths begin with `render/mirrorball_`.

mod checklist;
mod diagnostics;
#[cfg(feature = "egui")]
mod panel;
#[cfg(feature = "egui")]
mod sky_view;

pub use checklist::{Check, CheckLevel, Checklist};
pub use diagnostics::{CAPTURE_RATE, DECODE, DETECT, DROPPED, FeedDiagnosticsPlugin, LIGHTING_AGE, MEASURE};
#[cfg(feature = "egui")]
pub use panel::{MeasuringPanel, MeasuringPanelPlugin};
