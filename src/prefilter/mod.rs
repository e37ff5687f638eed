//! Raw environment → diffuse and specular maps that light every `StandardMaterial`.
//!
//! **Enters:** an [`EnvironmentCube`], or any cube map, equirectangular picture or render target that a game puts into a
//! [`LiveEnvironment`], on a camera or on a light probe; nothing else of this crate is needed. **Leaves:** a normal
//! [`EnvironmentMapLight`] on the same entity, at the intensity that makes 1.0 in the source 1.0 in the frame buffer.
//!
//! The diffuse map is the cosine-weighted sum of all light and the rough glossy levels are whole sums of GGX, both over 6·8²
//! blocks at their energy centroids. The sharp levels are rings of taps into a pyramid of splines (after Manson & Sloan 2016,
//! *Fast Filtering of Reflection Probes*) whose shares are fitted to the lobe for each level, and a share of the next rougher
//! level: the far tails of GGX are alike whatever the roughness. Each ring reads a cube of its own, the pyramid made equally sharp
//! everywhere: that takes the search for levels out of the taps, and small lamps show no more of where between texels they lie. All are
//! free of noise. [`Refresh`] says when they are made anew.
//!
//! # Cost
//! For each refresh, beside those of Bevy's `GeneratedEnvironmentMapLight` (read in its sources), which does this every frame:
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
//! Ours are lookups in flat faces with a texel of their neighbors around, not in cubes, so that nothing hangs on how a driver looks across
//! edges. Nothing is allocated for a refresh; bind groups, tables and buffers are made when a source arrives or changes its size.
//! `benches/environment.rs` measures time and truth of both.
//!
//! # More than light from afar
//! A [`SceneProbe`] makes a source of the virtual scene itself, over the measured room. [`DeskParallax`] lets a probe mirror
//! the part of the desk that is under it. [`CubePixels::harmonics`](crate::environment_map::CubePixels::harmonics)
//! is an environment in nine numbers for code on the CPU.
//!
//! # Files
//! Radiance and OpenEXR files become light, and measured light becomes a file:
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
mod taps;
mod update_environments;
mod viewing_camera;

pub use filtered_environment::FilteredEnvironment;
pub use live_environment::LiveEnvironment;
pub use parallax::DeskParallax;
pub use refresh::{EnvironmentState, Refresh};
pub use scene_probe::{SceneCube, SceneProbe};

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
use live_environment::{light_cameras_by_probe, remove_lighting};
use update_environments::{update_environments, update_intensities};

/// Filters live environments.
pub struct PrefilterPlugin;

impl Plugin for PrefilterPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.register_type::<LiveEnvironment>()
            .register_type::<EnvironmentState>()
            .register_type::<DeskParallax>()
            .add_observer(remove_lighting)
            .add_systems(
                PreUpdate,
                (light_cameras_by_probe, update_environments, update_intensities)
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
