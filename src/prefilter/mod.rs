//! Environment filter: environment → diffuse and specular maps that light every `StandardMaterial`.
//!
//! **Enters:** an [`EnvironmentCube`](crate::environment_map::EnvironmentCube), or any cube map, equirectangular
//! image or render target that a game puts into a [`LiveEnvironment`], on a camera or on a light probe. No other
//! stage of this crate is required. **Leaves:** a normal [`EnvironmentMapLight`] on the same entity, at the intensity
//! at which 1.0 in the source becomes 1.0 in the frame buffer.
//!
//! # Method
//! - The *diffuse map* is the cosine-weighted sum of all light. The *rough levels* of the specular map are full sums of
//!   GGX, or of another [`SpecularLobe`]. Both sums run over 6 · 8² blocks of the sphere at their energy centroids.
//! - The *sharp levels* of the specular map are rings of taps into a pyramid of splines (after Manson & Sloan 2016,
//!   *Fast Filtering of Reflection Probes*), plus a fraction of the next rougher level, because the far tails of
//!   GGX are alike for every roughness. The weights are fitted to the lobe for each level.
//! - Each ring reads a cube of its own, in which the pyramid is *equalized*: made equally sharp all over each face.
//!   Taps need not choose levels then, and the result does not depend on where between texels a small lamp lies.
//!
//! None of the maps has noise. [`Refresh`] decides when the maps are made again.
//!
//! # Cost
//! Work per refresh, beside that of Bevy's `GeneratedEnvironmentMapLight` (counted in its source code), which does it
//! every frame:
//!
//! | | ours, 128² | Bevy, 128² | ours, 256² | Bevy, 256² |
//! |---|---|---|---|---|
//! | texels loaded | 0.25 M | 0.2 M | 0.9 M | 0.8 M |
//! | filtered lookups | 0.6 M | 7.7 M | 2.3 M | 12.1 M |
//! | products of a block and a lobe | 1.95 M | – | 1.95 M | – |
//! | dispatches | 17 | 12 | 21 | 13 |
//! | bytes written | 1.8 MB | 2.1 MB | 6.8 MB | 8.4 MB |
//! | bind groups made | 0 | all | 0 | all |
//!
//! Our lookups read flat faces with a border of their neighbors' texels instead of cubes, so that the result does not
//! depend on how a driver interpolates across edges. A refresh allocates nothing: bind groups, tables and buffers are
//! made when a source arrives or changes its size. `benches/environment.rs` measures time and accuracy of both
//! filters.
//!
//! # Near surroundings
//! A [`SceneProbe`] renders the virtual scene, over the measured room, into a source. [`DeskParallax`] makes a probe
//! reflect the part of the desk that is under it. For code on the CPU,
//! [`CubePixels::harmonics`](crate::environment_map::CubePixels::harmonics) gives an environment as nine
//! coefficients.
//!
//! # Files
//! Radiance and OpenEXR files can be sources of light, and measured light can be saved to them:
//!
//! ```no_run
//! # use bevy::prelude::*;
//! # use bevy_mirrorball::{environment_map::{CubePixels, EnvironmentFileError, EquirectPixels}, prelude::*};
//! # fn example(camera: Entity, mut commands: Commands, mut images: ResMut<Assets<Image>>, measured: CubePixels)
//! # -> Result<(), EnvironmentFileError> {
//! let cube = EquirectPixels::open("studio.hdr")?.to_cube(128, Quat::IDENTITY);
//! commands.entity(camera).insert(LiveEnvironment::new(images.add(cube.to_image())));
//!
//! measured.to_equirect(1024, Quat::IDENTITY).save("my_desk.exr")?;
//! # Ok(())
//! # }
//! ```

mod blocks;
mod convolve;
mod cube_views;
mod dispatch;
mod downsample;
mod extract;
mod filter_pass;
mod filter_pipeline;
mod filter_plan;
mod filtered_environment;
mod live_environment;
mod lobe;
mod parallax;
mod prepare_filters;
mod refresh;
mod refresh_requests;
mod resample;
mod scene_faces;
mod scene_probe;
mod scene_probe_pass;
mod source;
mod specular_lobe;
mod taps;
mod update_environments;
mod viewing_camera;

pub use filtered_environment::FilteredEnvironment;
pub use live_environment::{LiveEnvironment, LiveEnvironmentTemplate};
pub use parallax::DeskParallax;
pub use refresh::{EnvironmentState, Refresh};
pub use scene_probe::{SceneCube, SceneProbe};
pub use specular_lobe::SpecularLobe;

pub(crate) use scene_faces::place_faces;

use crate::{
    MirrorballPasses, MirrorballSystems,
    device::{self, Needs},
    environment_map::{self, CubeWrites},
    trigonometry,
};
use bevy::{
    asset::embedded_asset,
    prelude::*,
    render::{ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems, renderer::RenderGraph},
    shader::load_shader_library,
};
use live_environment::{light_cameras_by_own_frames, light_cameras_by_probe, remove_lighting};
use update_environments::{update_environments, update_intensities};

/// Filters live environments and renders scene probes.
pub struct PrefilterPlugin;

impl Plugin for PrefilterPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.add_observer(remove_lighting)
            .add_systems(
                PreUpdate,
                (light_cameras_by_probe, light_cameras_by_own_frames, update_environments, update_intensities)
                    .chain()
                    .in_set(MirrorballSystems::Follow),
            )
            .add_systems(PostUpdate, refresh_requests::request_refreshes.after(bevy::asset::AssetEventSystems))
            .add_systems(PostUpdate, parallax::update_viewpoints.after(TransformSystems::Propagate));
        scene_faces::build(app);
    }

    fn finish(&self, app: &mut App) {
        let needs = Needs {
            plugin: "PrefilterPlugin",
            purpose: "environments will not be filtered",
            storage_buffers: 1,
            storage_textures: 2,
        };
        if device::can_draw(app, &needs) {
            build_filter(app);
            scene_probe_pass::build(app);
        }
    }
}

fn build_filter(app: &mut App) {
    crate::luminance::load(app);
    trigonometry::load(app);
    environment_map::load_shaders(app);
    load_shader_library!(app, "padded_faces.wgsl");
    embedded_asset!(app, "resample.wgsl");
    embedded_asset!(app, "downsample.wgsl");
    embedded_asset!(app, "convolve.wgsl");
    embedded_asset!(app, "taps.wgsl");
    app.sub_app_mut(RenderApp)
        .init_resource::<extract::ExtractedEnvironments>()
        .init_resource::<prepare_filters::PreparedFilters>()
        .init_resource::<CubeWrites>()
        .add_systems(RenderStartup, filter_pipeline::init_filter_pipelines)
        .add_systems(ExtractSchedule, extract::extract_environments)
        .add_systems(Render, prepare_filters::prepare_filters.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(RenderGraph, filter_pass::filter_pass.in_set(MirrorballPasses::ReadCubes));
}
