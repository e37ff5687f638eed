//! Environment → real lights.

mod least_squares;
mod meter;
mod ray_cast;
mod regions;
mod sky;
mod solve;

pub use meter::{MirrorBall, Paper};
pub use ray_cast::PhantomSolid;
pub use solve::{DeskPicture, SolvedLight, SolvedRegion, SolverCache, solve_light};
