//! Whole programs: the examples as child processes, and a game without a renderer.

mod built_example;
#[cfg(feature = "apriltag")]
mod calibrate;
mod composite;
#[cfg(feature = "egui")]
mod dance_places;
#[cfg(feature = "egui")]
mod dance_stage;
#[cfg(feature = "apriltag")]
mod looks;
#[cfg(feature = "apriltag")]
mod marker_sheet;
mod no_renderer;
mod picture_writers;
#[cfg(feature = "egui")]
mod room_walls;
#[cfg(feature = "egui")]
mod shadow_methods;
#[path = "../support/shared_data.rs"]
mod shared_data;
#[cfg(feature = "apriltag")]
mod small_programs;
#[cfg(feature = "apriltag")]
mod track_marker;
mod unwrap_ball;
