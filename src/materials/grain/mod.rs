//! The camera's hand: virtual things get the noise and the sharpness of the frame they are shown in.
//!
//! **Enters:** camera frames with the markers in them, and the rendered view. **Leaves:** [`GrainMeasurement`] on the
//! camera, and the same view, in which virtual things are blurred and noisy as the frame is.
//!
//! # Measurement
//! Once a second of the frames' time, in the background (in lockstep before the update goes on), 5 ms for
//! 640 × 480 pixels; the results are smoothed over a few measurements.
//! - *Noise*: the standard deviation of red, green and blue, and how far they share it, by brightness and in three
//!   octaves of spatial frequency, from the flattest blocks of the frame (Immerkær 1996, Liu et al. 2006).
//! - *Sharpness*: the width of the edges of the marker that is largest in the frame, as of slanted edges in ISO 12233.
//!   Until a marker is seen that is 30 pixels wide, virtual things stay sharp.
//!
//! # Rendering
//! With [`CameraGrain`], alpha tells real from virtual while the view is drawn, antialiased edges and transparent
//! things in part. One full-screen pass after tone mapping blurs virtual things by what their edges lack and adds noise
//! to them; the frame itself is left alone, and keeps its bits wherever nothing virtual is within the blur. Blurred
//! edges lie over the frame, so both edges of virtual things before real ones and those where a phantom hides them are
//! as wide as edges in the frame. The pass reads (2r + 1)² pixels, with r about 2.5 standard deviations of the blur,
//! and for virtual ones twelve texels of noise.
//!
//! # Limits
//! Motion blur of the camera counts as width, alike in all directions. Vignetting, focus by distance and the blocks of
//! strong compression are not imitated. Three octaves follow the spectrum of noise to about a fifth. What shows
//! through transparent things is blurred with them.

mod blur_kernel;
mod edge_width;
mod grain_pass;
mod grain_pipeline;
mod measure_grain;
mod noise_bands;
mod noise_tile;
mod prepare_grain;

pub use measure_grain::GrainMeasurement;

use crate::{
    MirrorballSystems,
    camera::{ArCamera, CameraFeed, MarksReal},
};
use bevy::{
    asset::embedded_asset,
    core_pipeline::{Core3d, Core3dSystems, tonemapping::tonemapping},
    prelude::*,
    render::{
        ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems, render_resource::SpecializedRenderPipelines,
    },
};

/// Gives virtual things the noise and the sharpness that are measured in the camera's frames; on an [`ArCamera`].
///
/// [`ArCamera`]s with a feed of a camera that is running (`CameraFeed::device`) get it by themselves, once: without it,
/// virtual things look cleaner and sharper than the real things beside them. Removed, it stays away. Images, clips and
/// pixels of the game have none unless it is added. Nothing is drawn or measured for cameras without it.
///
/// The same frames and the same seed give the same picture; noise changes when the frame does. In feeds of
/// [`FeedPace::Live`](crate::camera::FeedPace) the time at which a measurement is finished depends on the machine.
/// [`GrainMeasurement`] on the same entity has what was measured.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands) {
/// commands.spawn((ArCamera::default(), CameraFeed::clip("assets/desk_clip"), CameraGrain { seed: 7, ..default() }));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(GrainMeasurement)]
pub struct CameraGrain {
    /// Noise of virtual things relative to that of the frame, 0…4 (clamped). Defaults to 1, also used for NaN.
    pub noise: f32,
    /// Width of the edges of virtual things relative to those in the frame, 0…4 (clamped). Edges never become sharper
    /// than they are drawn, nor wider than a standard deviation of 2.8 pixels of the view. Defaults to 1, also used for
    /// NaN.
    pub blur: f32,
    /// Seed of the noise. Defaults to 0.
    pub seed: u32,
}

impl CameraGrain {
    pub(crate) const STRENGTHS: std::ops::RangeInclusive<f32> = 0.0..=4.0;

    fn clamped(strength: f32) -> f32 {
        if strength.is_nan() { 1.0 } else { strength.clamp(*Self::STRENGTHS.start(), *Self::STRENGTHS.end()) }
    }
}

impl Default for CameraGrain {
    fn default() -> Self {
        Self { noise: 1.0, blur: 1.0, seed: 0 }
    }
}

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "grain_pass.wgsl");
    let measure = (give_grain_to_live_cameras, mark_real_pixels, measure_grain::measure_grain).chain();
    app.add_systems(PreUpdate, measure.in_set(MirrorballSystems::Show));
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app
        .init_resource::<SpecializedRenderPipelines<grain_pipeline::GrainPipeline>>()
        .add_systems(RenderStartup, grain_pipeline::init_grain_pipeline)
        .add_systems(ExtractSchedule, prepare_grain::extract_grain)
        .add_systems(Render, prepare_grain::prepare_grain.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(Core3d, grain_pass::grain_pass.after(tonemapping).in_set(Core3dSystems::PostProcess));
}

/// Marks cameras that got [`CameraGrain`] by themselves, or had it.
#[derive(Component)]
struct HadGrain;

type NewFeed = (Entity, &'static CameraFeed, Has<CameraGrain>);

fn give_grain_to_live_cameras(
    mut commands: Commands,
    cameras: Query<NewFeed, (With<ArCamera>, Changed<CameraFeed>, Without<HadGrain>)>,
) {
    for (camera, _, has_grain) in cameras.iter().filter(|(_, feed, _)| feed.is_device()) {
        let mut camera = commands.entity(camera);
        camera.insert(HadGrain);
        if !has_grain {
            camera.insert(CameraGrain::default());
        }
    }
}

fn mark_real_pixels(
    mut commands: Commands,
    added: Query<Entity, (With<ArCamera>, With<CameraGrain>, Without<MarksReal>)>,
    removed: Query<Entity, (With<MarksReal>, Without<CameraGrain>)>,
) {
    for camera in &added {
        commands.entity(camera).insert(MarksReal);
    }
    for camera in &removed {
        commands.entity(camera).remove::<(MarksReal, measure_grain::RunningMeasurement, GrainMeasurement)>();
    }
}
