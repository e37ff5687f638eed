//! Light probes: where a mirrored ball or a probe camera is, and what it shows.
//!
//! **Enters:** the AR camera's newest frame, with its pose and intrinsics; the pose of a [`LightProbeSphere`]; the
//! phantoms around it; for clipped lights the pose of a marker; and the frames of every [`LightProbeCamera`].
//! **Leaves:** on the entity of each ball a [`ProbeMeasurement`] with the results, and private components from which
//! [`unwrap`](crate::unwrap) writes the [`EnvironmentCube`]. The stage also allocates that cube, one for all probes,
//! and chooses the [`EnvironmentFallback`] that lights the scene until something has been measured.
//!
//! # Frames and units
//! Camera space is Bevy's (−Z forward, +Y up), in meters. Radiance is in linear camera units: the frame divided by
//! the ball's reflectance, times the gain of the clip recovery where the camera had clipped.
//!
//! # What is measured
//! - the outline of the ball in the frame, and whether enough of it is in view,
//! - the fraction of all directions that the ball shows, with the frame's border and phantoms in front of it taken into
//!   account,
//! - how much brighter the visible directions have become since the frame before, and how much they have changed;
//!   [`unwrap`](crate::unwrap) ages its history accordingly,
//! - the fraction of clipped pixels, the radiance of the marker's paper, and the gain of clipped light.
//!
//! A measurement is repeated only if the frame, a pose, a setting or the phantoms have changed. [`EnvironmentMeasured`]
//! is triggered on a probe with its first one, and [`is_lit_by_measurement`] is a condition for systems.
//!
//! # Clipped light, first estimate
//! An 8-bit camera shows a lamp no brighter than white paper. The marker's paper makes up for what the clipped pixels
//! of the ball lack: the irradiance that the ball predicts at the paper must equal the irradiance that the paper's
//! brightness implies, π · paper ÷ paper reflectance (after Debevec et al. 2012, *A single-shot light probe*, with
//! one equation per channel). Of all solutions [`ClipRecovery`] takes the one with the least extra light in the
//! least-squares sense: clipped light from a direction is multiplied by 1 + (gain − 1) · cosine to the paper's
//! normal, light from below the horizon by 1. Windows that the paper barely sees are thus not brightened on behalf of
//! the lamp above. One sheet of paper does not give enough equations to decide which of several lamps is the strong
//! one. The stage [`lighting`](crate::lighting) takes further equations from everything that stands on the desk and
//! returns a gain per direction, which replaces this one a frame later (in lockstep at once).
//!
//! # Cost
//! On the CPU 12 000 lookups in each new frame for the clip recovery, and 216 to detect changes. The first run in the
//! background for live frames that follow one another: [`ProbeMeasurement::gain`] is that of the frame before then.
//!
//! # Limits
//! Phantoms hide as much as the boxes around their meshes, which is a little too much for round ones.

mod ball_photo;
mod ball_points;
mod ball_view;
mod choose_fallbacks;
mod clip_recovery;
mod clip_task;
mod clipping;
mod ellipse;
mod fallback;
mod fisheye_projection;
mod history;
mod lens;
mod lens_error;
mod light_probe_sphere;
mod measure;
mod measured_event;
mod observer;
mod own_environment;
mod paper;
mod photo_pixels;
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
pub use measured_event::{EnvironmentMeasured, is_lit_by_measurement};
pub use photo_pixels::{LinearPixels, PhotoPixels, open_photo};
pub use probe_camera::{LightProbeCamera, ProbeCameraState};
pub use probe_measurement::ProbeMeasurement;
pub use sky_gradient::SkyGradient;

pub(crate) use ball_view::EDGE_MARGIN_PIXELS;
pub(crate) use clipping::{MAX_SATURATION, WHITE_FROM, clipped_from_linear, gain_limits};
pub(crate) use fallback::FallbackImage;
pub(crate) use history::HistoryHint;
pub(crate) use lens::LensNumbers;
pub(crate) use own_environment::{OwnEnvironment, OwnView};
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

/// Plugin of the probe stage: measures what light probes show.
pub struct ProbePlugin;

impl Plugin for ProbePlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.register_required_components::<ArCamera, EnvironmentFallback>()
            .add_systems(PreUpdate, allocate_cubes.in_set(MirrorballSystems::Allocate))
            .add_systems(
                PostUpdate,
                (
                    (measure::measure_probes, probe_camera::update_lens_views),
                    (own_environment::measure_own_views, choose_fallbacks::choose_fallbacks)
                        .run_if(resource_exists::<Assets<Image>>),
                    measured_event::report_measurements,
                )
                    .chain()
                    .in_set(MirrorballSystems::Measure),
            );
    }
}

/// Loads the shader libraries of balls and solids, for shaders that import them.
pub(crate) fn load_shaders(app: &mut App) {
    load_shader_library!(app, "ball_view.wgsl");
    load_shader_library!(app, "solids.wgsl");
}

/// Environment cube that all probes share.
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
