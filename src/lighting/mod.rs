//! Environment → how bright the clipped lights really are.
//!
//! **Enters:** the camera's newest picture and shorter exposures, the markers seen in it, the ball, the phantoms. **Leaves:** a [`RecoveredLight`] on the
//! ball's entity, and the gain of every clipped piece of the sky for the pass that unwraps the ball.
//!
//! # How
//! An 8-bit camera shows a lamp and a white wall alike. What they lack is told by what stands on the desk (after Debevec et al.
//! 2012, *A single-shot light probe*): some 500 points of the picture on the marker's paper, on the desk and on other phantoms. For
//! each of them rays tell which part of the sky it sees past phantoms and ball, and how much of the sky it sees mirrored in the
//! ball. The clipped part of the sky is cut into pieces of at most some 20°. Unknown are the gain of each piece and the albedo of each surface; the equation of
//! a point is
//!
//! ```text
//! π · radiance in the picture ÷ albedo = irradiance of what is not clipped + Σ pieces (gain − 1) · irradiance of the piece
//! ```
//!
//! The paper's albedo is known and gives the absolute scale. All others cancel: it is the shadows in the picture, and faces of
//! different orientation, that tell the pieces apart. The desk may have two albedos (a checkered cloth, a wooden grain), told apart
//! anew in each round. Unknowns are not negative; what no equation says stays at the least extra light, with the color of the light
//! as a whole. Outliers (fireflies, prints, edges) lose their weight by their distance (Cauchy).
//!
//! Clipped light is taken to be brighter towards the middle of what is clipped, as windows and soft boxes are.
//!
//! # More evidence
//! - A phantom with a known [`reflectance`](crate::phantom::PhantomObject::reflectance), such as a folded sheet of paper, is as absolute a
//!   measure as the marker, and its faces look at different lamps.
//! - A dark ball ([`LightProbeSphere::is_dark`](crate::probe::LightProbeSphere::is_dark), K 3.1.6) shows in the same picture what the
//!   bright one clips: how bright each piece is and how its light is spread. What it clips too remains a lower bound.
//! - A [`ShorterExposure`] of the same desk shows the same in the bright ball itself (after Debevec & Malik 1997). Of several views of a
//!   piece the one that clips least of it counts, of several such ones the brightest. A picture whose paper is not as dark as its exposure says, by a quarter or
//!   more, shows other light and is ignored. On a ray-traced desk with lamps 90, 18 and 4 times white, and nothing but the
//!   marker's paper beside the ball, their errors go from −42, +200 and +113 % to +2, 0 and −3 % with exposures of 1/8 and 1/125.
//!   A camera's [`ShorterFrames`](crate::camera::ShorterFrames) are told of with the next usual picture, for five seconds at most; where the
//!   ball was in them follows from the pictures before and after. No phantoms are needed then, but the marker is.
//!
//! # Near lamps
//! A lamp two metres away lights the near edge of a desk by a third more than the far one, and its shadows fan out. The strongest
//! compact pieces are tried at a few distances; one is kept where it explains the whole desk clearly better
//! ([`SolvedRegion::position`]). Two balls that mirror a lamp from different directions tell more exactly where it is.
//!
//! # Two cameras
//! [`match_cameras`] compares the paper in pictures of two cameras: the ratio of their exposures and white balances.
//!
//! # Lights
//! A [`RealLight`] is a compact part of the recovered sky, at least 2.5 times as bright as what surrounds it and four times the median; wide bright
//! skies and walls are none. Groups of bright cells are split where that leaves little of their variance and merged where they are close. A
//! light keeps its number and entity while it moves by less than 20° from picture to picture; it appears with 3 % of all light, stays down
//! to 1 %, and vanishes after five pictures without it. [`RealLightAppeared`] and [`RealLightVanished`] tell of it.
//!
//! # Self-check
//! Each new picture of the ball is compared with a virtual ball that mirrors the light shown until then: [`SelfCheck`].
//!
//! # Measured
//! Path-traced desks under five measured rooms, error of a composite on virtual objects and in their shadows (0: as if really there,
//! shadow 1: none drawn):
//!
//! | room | clipped light as white | one gain, from the paper | a gain per piece, from the desk |
//! |---|---|---|---|
//! | studio | 0.87 / 0.49 | 0.37 / 0.10 | 0.13 / 0.03 |
//! | lodge | 0.39 / 0.45 | 0.34 / 0.40 | 0.16 / 0.31 |
//! | sunset | 0.30 / 0.32 | 0.18 / 0.30 | 0.13 / 0.32 |
//! | warehouse | 0.73 / 0.36 | 0.20 / 0.40 | 0.14 / 0.24 |
//! | plaza | 0.18 / 0.10 | 0.11 / 0.09 | 0.10 / 0.11 |
//!
//! Irradiance against the true maps is within 2 % at the marker and 23 % at surfaces tilted by 53°. On a desk with a lamp two metres
//! away, the same scores with the lamp taken for far away and where it is: 0.26 / 0.29 and 0.20 / 0.22 (means of four pictures).
//!
//! # Cost
//! On a thread in the background, one picture at a time: some 500 points × 6144 directions. Rays are traced anew only when something has
//! moved by millimetres or the camera by 5 cm. Lamps are looked for at all distances when the desk is explained 1.4 times worse than when that
//! was last done; otherwise they are kept up to date. In lockstep feeds the frame waits for the answer.
//!
//! # Limits
//! The real things on the desk have to be phantoms: a shadow without a phantom looks like a dark spot, and with none in view the paper alone
//! tells. Light between things other than the ball's mirror light is not modeled. A piece of the sky that holds a near lamp and a far
//! one has one distance. Under many clipped lamps of similar size paper alone does not tell which is the strongest. What
//! the camera clips in part of a channel's paper is not used in that channel.
//!
//! Sources: Debevec et al. 2012; Supan 2006 (row C7) for lights out of an environment map.

mod bracketing;
mod clip_gains;
mod desk_solids;
mod recover;
pub mod solver;
mod track_lights;

pub use recover::RecoveredLight;
pub use solver::camera_match::{CameraMatch, match_cameras};
pub use solver::self_check::SelfCheck;
pub use track_lights::{RealLight, RealLightAppeared, RealLightVanished};

pub(crate) use clip_gains::ClipGains;

use crate::MirrorballSystems;
use bevy::prelude::*;

/// Recovers clipped light.
pub struct LightingPlugin;

impl Plugin for LightingPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.register_type::<RealLight>()
            .register_type::<CameraMatch>()
            .register_type::<SelfCheck>()
            .add_message::<RealLightAppeared>()
            .add_message::<RealLightVanished>()
            .init_resource::<desk_solids::DeskSolids>()
            .init_resource::<track_lights::NextLightId>()
            .add_systems(
                PostUpdate,
                (
                    desk_solids::collect_phantoms,
                    bracketing::estimate_bracketed_poses,
                    recover::recover_lights,
                    track_lights::track_lights,
                )
                    .chain()
                    .in_set(MirrorballSystems::Light),
            );
    }
}

/// Old name of [`solver::DeskFrame`].
#[deprecated(since = "0.1.0", note = "use `lighting::solver::DeskFrame`")]
#[doc(hidden)]
pub type DeskPicture = solver::DeskFrame;
/// Old name of [`solver::DetectedLight`].
#[deprecated(since = "0.1.0", note = "use `lighting::solver::DetectedLight`")]
#[doc(hidden)]
pub type FoundLight = solver::DetectedLight;
/// Moved to [`solver::MirrorBall`].
#[deprecated(since = "0.1.0", note = "use `lighting::solver::MirrorBall`")]
#[doc(hidden)]
pub type MirrorBall = solver::MirrorBall;
/// Moved to [`solver::Paper`].
#[deprecated(since = "0.1.0", note = "use `lighting::solver::Paper`")]
#[doc(hidden)]
pub type Paper = solver::Paper;
/// Moved to [`solver::PhantomSolid`].
#[deprecated(since = "0.1.0", note = "use `lighting::solver::PhantomSolid`")]
#[doc(hidden)]
pub type PhantomSolid = solver::PhantomSolid;
/// Old name of [`solver::BracketedExposure`].
#[deprecated(since = "0.1.0", note = "use `lighting::solver::BracketedExposure`")]
#[doc(hidden)]
pub type ShorterExposure = solver::BracketedExposure;
/// Moved to [`solver::SolvedLight`].
#[deprecated(since = "0.1.0", note = "use `lighting::solver::SolvedLight`")]
#[doc(hidden)]
pub type SolvedLight = solver::SolvedLight;
/// Moved to [`solver::SolvedRegion`].
#[deprecated(since = "0.1.0", note = "use `lighting::solver::SolvedRegion`")]
#[doc(hidden)]
pub type SolvedRegion = solver::SolvedRegion;
/// Moved to [`solver::SolverCache`].
#[deprecated(since = "0.1.0", note = "use `lighting::solver::SolverCache`")]
#[doc(hidden)]
pub type SolverCache = solver::SolverCache;
/// Moved to [`solver::solve_light`].
#[deprecated(since = "0.1.0", note = "use `lighting::solver::solve_light`")]
#[doc(hidden)]
pub fn solve_light(desk: &solver::DeskFrame, cache: &mut solver::SolverCache) -> Option<solver::SolvedLight> {
    solver::solve_light(desk, cache)
}
