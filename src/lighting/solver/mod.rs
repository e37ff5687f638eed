//! The solver of clipped light: pure functions from a frame and what stands on the desk to radiance.

mod albedos;
pub(super) mod camera_match;
mod darker_view;
mod desk_picture;
mod equations;
mod find;
mod gains;
mod least_squares;
mod meter;
mod mirrored_sky;
mod near_light;
mod ray_cast;
mod regions;
pub(super) mod self_check;
mod sky;
mod solve;
mod solved_light;
mod triangulate;

pub use desk_picture::{DeskPicture, MirrorBall, Paper, ShorterExposure};
pub use find::FoundLight;
pub use ray_cast::PhantomSolid;
pub use solve::{SolverCache, solve_light};
pub use solved_light::{SolvedLight, SolvedRegion};

pub(super) use find::LEAST_SHARE;
pub(super) use sky::SKY_EDGE;
pub(super) use solve::unsolved_light;
