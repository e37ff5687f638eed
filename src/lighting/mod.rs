//! Recovery of clipped light: the environment and the desk → how bright the clipped lights really are.
//!
//! **Enters:** the newest frame of the camera and bracketed frames, the markers detected in it, the ball, the phantoms.
//! **Leaves:** a [`RecoveredLight`] on the ball's entity, the gain of every clipped region of the sky for the pass that
//! unwraps the ball, and a [`RealLight`] entity per light.
//!
//! # Method
//! An 8-bit camera shows a lamp and a white wall alike. The missing brightness follows from what stands on the desk
//! (after Debevec et al. 2012, *A single-shot light probe*): some 500 sample points of the frame on the marker's paper,
//! on the desk and on other phantoms, small ones in finer steps. Rays from each point determine which part of the sky
//! it sees past phantoms and ball, and how much of the sky it sees mirrored in the ball. The clipped part of the sky is
//! cut into regions of at most some 20°. The unknowns are the gain of each region and the albedo of each surface; the
//! equation of a point is
//!
//! ```text
//! π · radiance in the frame ÷ albedo
//!     = irradiance of what is not clipped + Σ regions (gain − 1) · irradiance of the region
//! ```
//!
//! The paper's albedo is known and gives the absolute scale. All other albedos cancel: the regions are distinguished by
//! the shadows in the frame and by faces of different orientation. A phantom may have two albedos (a checkered cloth, a
//! can and its lid), which are classified anew in each round; faces that look different ways only if their colors
//! differ or if no light explains them. Unknowns are not negative; what no equation determines stays
//! at the least extra light, with the color of the light as a whole. Outliers (fireflies, prints, edges) lose weight
//! with their distance (Cauchy).
//!
//! In a channel in which the paper clips, the ink of the marker tells its brightness: black print is as gray as paper.
//!
//! Clipped light is assumed to be brighter towards the middle of what is clipped, as in windows and soft boxes.
//!
//! # More evidence
//! - A phantom with a known [`reflectance`](crate::phantom::PhantomObject::reflectance), such as a folded sheet of
//!   paper, is as absolute a measure as the marker, and its faces look at different lamps.
//! - A dark ball ([`LightProbeSphere::is_dark`](crate::probe::LightProbeSphere::is_dark); Karlsson & Selegård 2005)
//!   shows in the same frame what the bright ball clips: the brightness of each region and the distribution of its
//!   light. What the dark ball clips too remains a lower bound.
//! - A [`BracketedExposure`](solver::BracketedExposure) of the same desk shows the same in the bright ball itself
//!   (after Debevec & Malik 1997). For each region the solver uses the view with the fewest clipped pixels; ties go to
//!   the brightest view, which has the least noise. A frame whose paper differs by a quarter or more from its stated
//!   exposure shows other light and is ignored. On a ray-traced desk with lamps 90, 18 and 4 times white, and nothing
//!   but the marker's paper beside the ball, exposures of 1/8 and 1/125 reduce the errors of the lamps from −42, +200
//!   and +113 % to +2, 0 and −3 %. A camera's [`BracketedFrames`](crate::camera::BracketedFrames) are used with the
//!   next normal frame, for five seconds at most; the pose of the ball in them is interpolated between the frames
//!   before and after. Phantoms are not needed then, but the marker is.
//!
//! # The sun in bright clouds
//! The ball shows a sun and the clouds around it alike, and the regions share their light evenly. Where in them the sun
//! is, and whether there is one, shows at the edges of the shadows on the desk. For a direction, the solver walks along
//! the outlines of balls and phantoms as seen from there, and compares the frame on both sides of where their shadows
//! would end. Only a small light makes edges that are sharp far away from what throws them. The direction with the
//! clearest edges becomes a light of its own if the step is significant against its noise and against the other
//! directions, if it is as high close to the edge as at some distance, and if the light explains the desk better than
//! wide light alone. Its strength follows from the same equations as that of the regions, and its angular radius from
//! the sharpness of the edges. The environment cube shows it as a spot of a few texels with all of its light. Not
//! needed, and not tried, with darker views, which show the sun itself.
//!
//! # Near lamps
//! A lamp two meters away lights the near edge of a desk by a third more than the far edge, and its shadows fan out.
//! The solver tries a few distances for the strongest compact regions and keeps one if it explains the whole desk
//! clearly better ([`SolvedRegion::position`](solver::SolvedRegion::position)). Two balls that mirror a lamp from
//! different directions reveal its position more exactly.
//!
//! # Two cameras
//! [`match_cameras`] compares the paper in frames of two cameras: the ratio of their exposures and white balances.
//!
//! # Lights
//! A [`RealLight`] is a compact part of the recovered sky, at least 2.5 times as bright as its surroundings and four
//! times the median; wide bright skies and walls are not lights. Groups of bright cells are split where that leaves
//! little of their variance and merged where they are close. A light keeps its number and entity while it moves by less
//! than 20° from frame to frame. It appears with 3 % of all light, stays down to 1 %, and vanishes after five frames
//! without it. [`RealLightAppeared`] and [`RealLightVanished`] report both.
//!
//! # Self-check
//! Each new frame of the ball is compared with a virtual ball that mirrors the light on display: [`SelfCheck`].
//!
//! # Measured
//! Path-traced desks under five measured rooms, error of a composite on virtual objects / in their shadows (0: as if
//! really there, shadow 1: none drawn):
//!
//! | room | clipped light as white | one gain, from the paper | a gain per piece, from the desk |
//! |---|---|---|---|
//! | studio | 0.90 / 2.82 | 0.36 / 0.15 | 0.10 / 0.03 |
//! | lodge | 0.39 / 0.19 | 0.34 / 0.17 | 0.10 / 0.04 |
//! | sunset | 0.30 / 0.17 | 0.17 / 0.13 | 0.08 / 0.11 |
//! | warehouse | 0.74 / 0.92 | 0.21 / 0.26 | 0.13 / 0.08 |
//! | plaza | 0.17 / 0.02 | 0.09 / 0.02 | 0.08 / 0.02 |
//!
//! In a sixth one, a street under a sun among clouds, they are 0.10 / 0.01; the sun as a light of its own is 0.2° off
//! and within 5 % of its irradiance.
//!
//! Irradiance against the true maps is within 1.1 % at the marker, and at surfaces tilted by 53° within 14 % under the
//! lamps of the studio, 12 % at sunset, 7 % in the others. On a desk with a lamp two meters away, treated as distant or
//! at its real position, the same scores were 0.26 / 0.29 and 0.20 / 0.22 before bounced light; they are 0.16 / 0.06
//! now (means of four frames).
//!
//! # Cost
//! The solver runs on a background thread, one frame at a time: some 500 points × 6144 directions. Rays are traced anew
//! only when something has moved by millimeters or the camera by 5 cm. All distances of lamps are searched when the
//! desk is explained 1.4 times worse than at the last search; otherwise the known ones are refined. A small light is
//! searched among all clipped directions every 16 frames, and refined where it was found. In lockstep feeds the frame
//! waits for the result.
//!
//! # Limits
//! - The real things on the desk have to be phantoms: a shadow without a phantom looks like a dark spot, and with no
//!   phantom in view only the paper counts.
//! - Light between objects is not modeled, except for the light that the ball mirrors.
//! - One small light is found by its shadows. It needs shadows of balls or phantoms that fall onto phantoms in view.
//! - A region of the sky that holds a near lamp and a far one has one distance.
//! - Under many clipped lamps of similar size, paper alone does not reveal which is the strongest.
//! - Where the camera clips a part of the paper in a channel, that part is not used in that channel; ink stands in for
//!   it where most of the paper is clipped and the marker is large enough (a cell of seven pixels).
//!
//! Sources: Debevec et al. 2012; Supan 2006 for lights from an environment map.

mod bracketing;
mod clip_gains;
mod desk_solids;
mod recover;
mod solve_job;
pub mod solver;
mod track_lights;

pub use recover::RecoveredLight;
pub use solver::camera_match::{CameraMatch, match_cameras};
pub use solver::self_check::SelfCheck;
pub use track_lights::{RealLight, RealLightAppeared, RealLightVanished};

pub(crate) use clip_gains::ClipGains;

use crate::MirrorballSystems;
use bevy::prelude::*;

/// Plugin that recovers clipped light and tracks real lights.
pub struct LightingPlugin;

impl Plugin for LightingPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.add_message::<RealLightAppeared>()
            .add_message::<RealLightVanished>()
            .init_resource::<desk_solids::DeskSolids>()
            .init_resource::<track_lights::NextLightId>()
            .add_systems(
                PostUpdate,
                (
                    desk_solids::collect_phantoms,
                    bracketing::estimate_bracketed_poses,
                    bracketing::warn_of_unused_brackets,
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
