//! Frame + ball pose → raw environment cube.
//!
//! **Enters:** the camera's newest picture, its pose and intrinsics, the pose of a [`LightProbeSphere`], phantoms around it, and for the
//! clipped lights the pose of a marker; or the picture of a [`LightProbeCamera`]. **Leaves:** an [`EnvironmentCube`] on the ball's entity, rewritten on the GPU whenever
//! something it depends on has changed, and a [`ProbeMeasurement`] that says what was seen.
//!
//! # Frames and units
//! The cube is in world axes and Bevy's left-handed cube convention (a lookup negates z). It holds radiance in linear camera
//! units: the picture divided by the ball's reflectance, times the recovery's gain where the camera had clipped.
//!
//! # What nobody sees
//! The ball hides a cone behind itself (half angle asin(radius/distance), about 4° at 0.75 m), the outermost 1.5 pixels of its picture mix
//! with the background, phantoms stand in front of it, the picture ends. Every texel has a confidence (pixels per texel where it is seen;
//! a third is left after four seconds, less if the rest has changed) and takes the best there is, blended without an edge:
//! 1. what is seen now, unless it was seen much finer not long ago and still looks like that,
//! 2. towards the rim and behind it, where the ball is coarse: the camera's own picture of the phantoms that lie there (as boxes; by
//!    direction where none does, once there are any),
//! 3. behind the rim: an ever longer arc of the rim,
//! 4. elsewhere: what was seen earlier, scaled as the rest of the picture has become brighter or darker,
//! 5. the [`EnvironmentFallback`], until something has been measured.
//!
//! # Several pictures, one cube
//! All balls and every [`LightProbeCamera`] (fisheye, 360°, sphere map) write one cube, one after the other; where several see, the finer
//! picture wins. So a fisheye that looks up and a ball that shows the rest become one environment (row A9).
//!
//! # As sharp as the picture
//! A mirror that reads the cube linearly between its texels should show the pixels of the picture again, not a blur of them. What the
//! passages between pixels and between texels spread over the neighbors is therefore taken back from them. Clipped pixels are left as they
//! are; what a lamp has spread into its neighbors goes, for a clipped lamp counts as white already.
//!
//! # Clipped light, first form
//! An 8-bit camera shows a lamp no brighter than white paper. What the clipped pixels of the ball lack is told by the marker's
//! paper: the irradiance the ball predicts at it must be what its brightness says, π · paper ÷ paper reflectance (after Debevec
//! et al. 2012, *A single-shot light probe*, with one equation per channel). Of all answers [`ClipRecovery`] takes the one
//! with the least extra light in the least-squares sense: clipped light from a direction is multiplied by
//! 1 + (gain − 1) · cosine to the paper's normal, light from below the horizon by 1. So windows that the paper barely sees are
//! not blown up for the lamp above. Which of several lamps is the strong one needs more equations than one sheet of paper gives:
//! the stage [`lighting`](crate::lighting) takes them from all that stands on the desk and hands a gain per direction back, which
//! replaces this one a picture later (in lockstep at once).
//!
//! # Cost
//! One compute dispatch of 6 · size² threads per picture, each with three searches for a pixel, as many lookups of four pixels as it covers
//! pixels (one for balls up to some 250 pixels across, at most 16) and one of twelve for what is spread, and a copy of the cube; on the CPU 12 000 picture lookups per new picture
//! for the recovery and 216 for what has changed.
//!
//! # Limits
//! Round phantoms hide as much as the boxes around them. What the camera's picture adds comes from the point on the box, as matte things
//! would. All probes are merged by direction, as if they stood at one place.

mod ball_photo;
mod ball_view;
mod choose_fallbacks;
mod clip_recovery;
mod clipping;
mod ellipse;
mod fallback;
mod fisheye_projection;
mod history;
mod lens;
mod lens_error;
mod light_probe_sphere;
mod measure;
mod paper;
mod probe_camera;
mod probe_measurement;
mod sky_gradient;
mod solids;

pub use ball_photo::{BallPhoto, BallPhotoError};
pub use ball_view::BallView;
pub use clip_recovery::{ClipEvidence, ClipRecovery};
pub use ellipse::Ellipse;
pub use fallback::{EnvironmentFallback, EnvironmentOrigin};
pub use fisheye_projection::FisheyeProjection;
pub use lens::{ImageCircle, ProbeLens};
pub use lens_error::LensError;
pub use light_probe_sphere::{BallSurface, LightProbeSphere, UniformSky};
pub use probe_camera::{LightProbeCamera, ProbeCameraState};
pub use probe_measurement::ProbeMeasurement;
pub use sky_gradient::SkyGradient;

pub(crate) use ball_view::EDGE_MARGIN_PIXELS;
pub(crate) use clipping::{MAX_SATURATION, WHITE_FROM, clipped_from_linear, gain_limits};
pub(crate) use fallback::FallbackImage;
pub(crate) use history::HistoryHint;
pub(crate) use lens::LensNumbers;
pub(crate) use paper::{MARGIN_CELLS, SQUARE_CELLS};
pub(crate) use probe_camera::LensView;
pub(crate) use probe_measurement::ProbeView;
pub(crate) use solids::{SolidUniform, Surroundings};

/// Old name of [`BallPhoto`].
#[deprecated(since = "0.1.0", note = "use `BallPhoto`")]
#[doc(hidden)]
pub type BallPicture<'a> = BallPhoto<'a>;
/// Old name of [`BallPhotoError`].
#[deprecated(since = "0.1.0", note = "use `BallPhotoError`")]
#[doc(hidden)]
pub type BallPictureError = BallPhotoError;

#[doc(hidden)]
pub use crate::environment_map::{CubeWrites, EnvironmentCube};

use crate::{MirrorballSystems, camera::ArCamera, environment_map::LitByGame};
use bevy::{light::EnvironmentMapLight, prelude::*, shader::load_shader_library};

/// Measures the light that falls on the probes.
pub struct ProbePlugin;

impl Plugin for ProbePlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.register_type::<LightProbeSphere>()
            .register_type::<BallSurface>()
            .register_type::<UniformSky>()
            .register_type::<ClipRecovery>()
            .register_type::<ClipEvidence>()
            .register_type::<ProbeMeasurement>()
            .register_type::<LightProbeCamera>()
            .register_type::<ProbeCameraState>()
            .register_type::<EnvironmentFallback>()
            .register_type::<EnvironmentOrigin>()
            .register_required_components::<ArCamera, EnvironmentFallback>()
            .add_systems(PreUpdate, allocate_cubes.in_set(MirrorballSystems::Allocate))
            .add_systems(
                PostUpdate,
                (
                    (measure::measure_probes, probe_camera::update_lens_views),
                    choose_fallbacks::choose_fallbacks.run_if(resource_exists::<Assets<Image>>),
                )
                    .chain()
                    .in_set(MirrorballSystems::Measure),
            );
    }
}

/// Makes the libraries of balls and boxes known to the shaders of a plugin.
pub(crate) fn load_shaders(app: &mut App) {
    load_shader_library!(app, "ball_view.wgsl");
    load_shader_library!(app, "solids.wgsl");
}

/// The one environment cube.
#[derive(Resource)]
struct SharedCube(EnvironmentCube);

type Unlit = (With<EnvironmentFallback>, Without<EnvironmentMapLight>, Without<LitByGame>);
type NewProbe = (Or<(With<LightProbeSphere>, With<LightProbeCamera>, Unlit)>, Without<EnvironmentCube>);

fn allocate_cubes(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    cube: Option<Res<SharedCube>>,
    probes: Query<(Entity, Option<&LightProbeSphere>), NewProbe>,
) {
    let mut new = probes.iter().filter(|(_, sphere)| !sphere.is_some_and(LightProbeSphere::is_dark)).peekable();
    if new.peek().is_none() {
        return;
    }
    let cube = cube.map_or_else(|| EnvironmentCube::allocate(&mut images), |cube| cube.0.clone());
    for (probe, _) in new {
        commands.entity(probe).insert(cube.clone());
    }
    commands.insert_resource(SharedCube(cube));
}
