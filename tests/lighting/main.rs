//! The light of the real room: environments from balls, lenses and fallbacks, and the lights solved from them.

#[path = "../support/cubes.rs"]
mod cubes;
mod darker_views;
mod gizmos;
#[path = "../support/gpu.rs"]
mod gpu;
mod lights;
#[path = "../support/logged.rs"]
mod logged;
mod map_view;
mod measured_event;
#[cfg(feature = "apriltag")]
mod measuring;
mod probe;
mod probe_sources;
#[path = "../support/shared_data.rs"]
mod shared_data;
#[path = "../support/sky_cube.rs"]
mod sky_cube;
mod several_cameras;
mod solved;
mod sphere;
mod traced_desk;
mod truth;
mod unused_brackets;
mod unwrap_truth;
