//! The render world's half of planar shadows.
//!
//! **Enters:** the [`PlanarPlans`](super::planned::PlanarPlans) of the main world. **Leaves:** the fraction of light
//! that is left, per color, in the texture of each receiver whose plan has changed.
//!
//! First `planar_sky_pass.wgsl` weighs the directions of the ambient light by the environment. Then, for each light,
//! `planar_mask_pass.wgsl` draws the casters once per point of the light into a mask, from straight
//! above, and adds up; `planar_blur_pass.wgsl` blurs the mask along columns and rows, and takes the light's share of it
//! from the texture.

mod blur_pipeline;
mod mask_pipeline;
mod planar_pass;
mod prepare_planar;
mod prepare_sky;
mod sky_pipeline;

use super::planned::PlanarPlans;
use crate::MirrorballPasses;
use bevy::{
    asset::embedded_asset,
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        Render, RenderApp, RenderStartup, RenderSystems,
        extract_resource::ExtractResourcePlugin,
        render_resource::SpecializedMeshPipelines,
        renderer::{RenderGraph, RenderGraphSystems},
    },
    shader::load_shader_library,
};

/// Adds the pass and what prepares it. The pipelines of the dome have to be there.
pub(in crate::shadows) fn build(app: &mut App) {
    load_shader_library!(app, "planar_view.wgsl");
    embedded_asset!(app, "planar_sky_pass.wgsl");
    embedded_asset!(app, "planar_mask_pass.wgsl");
    embedded_asset!(app, "planar_blur_pass.wgsl");
    app.add_plugins(ExtractResourcePlugin::<PlanarPlans>::default());
    app.sub_app_mut(RenderApp)
        .init_resource::<SpecializedMeshPipelines<mask_pipeline::MaskPipeline>>()
        .init_resource::<prepare_planar::PreparedPlanar>()
        .init_resource::<prepare_sky::SkyCells>()
        .add_systems(
            RenderStartup,
            (
                mask_pipeline::init_mask_pipeline.after(crate::shadows::render::depth_pipeline::init_depth_pipeline),
                blur_pipeline::init_blur_pipelines,
                sky_pipeline::init_sky_pipeline,
            ),
        )
        .add_systems(Render, prepare_planar::prepare_planar.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(
            RenderGraph,
            planar_pass::planar_pass
                .after(MirrorballPasses::ReadCubes)
                .in_set(RenderGraphSystems::Render)
                .before(camera_driver),
        );
}
