//! Solver for clipped light: pure functions from a frame and the things on the desk to the radiance of the
//! surroundings.
//!
//! **Enters:** a [`DeskFrame`]: a posed frame, mirrored balls, marker sheets, phantoms and bracketed exposures.
//! **Leaves:** a [`SolvedLight`], from [`solve_light`], and its [`DetectedLight`]s, from [`DeskFrame::lights`]. The
//! method is described in [`lighting`](super).

mod albedos;
mod ball_reflection;
mod bracketed_views;
mod desk_frame;
mod detect_lights;
mod equations;
mod light_transport;
mod near_light;
mod radiance_cells;
mod ray_cast;
mod regions;
mod robust_fit;
mod sample_points;
mod shadow_edges;
mod silhouettes;
mod small_light;
mod solve;
mod solved_light;
mod triangulate;
pub(super) mod camera_match;
pub(super) mod self_check;

pub use desk_frame::{BracketedExposure, DeskFrame, MirrorBall, Paper};
pub use detect_lights::DetectedLight;
pub use ray_cast::PhantomSolid;
pub use solve::{SolverCache, solve_light};
pub use solved_light::{SolvedLight, SolvedRegion};

pub(super) use detect_lights::MIN_LIGHT_FRACTION;
pub(super) use radiance_cells::CELLS_PER_EDGE;
pub(super) use solve::unsolved_light;
pub(super) use solved_light::PointLight;
