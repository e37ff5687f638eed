//! Draw calls and textures for the receivers whose plans have changed.

use super::{
    super::{
        light_points::LightShare,
        planned::{PlanarPlan, PlanarPlans, PlanarView, PlannedLight},
    },
    blur_pipeline::{BlurPipelines, BlurUniform},
    mask_pipeline::{MASK_FORMAT, MaskPipeline, STENCIL_FORMAT},
    prepare_sky::{SkyCells, bind_sky},
    sky_pipeline::SkyPipeline,
};
use crate::{
    environment_map::cube_faces,
    shadows::render::{
        caster_buffers::CasterBuffers,
        caster_draw::{CasterDraw, caster_draws},
        depth_pipeline::DepthPipeline,
        gpu::{Gpu, GpuAssets},
    },
};
use bevy::{
    ecs::system::SystemParam,
    platform::collections::HashMap,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, Extent3d, SpecializedMeshPipelines, TextureDescriptor, TextureDimension,
            TextureFormat, TextureUsages, TextureView, UniformBuffer,
        },
        texture::{FallbackImage, TextureCache},
    },
};
use std::ops::Range;

/// What is drawn in this frame, and what was drawn before.
#[derive(Resource, Default)]
pub(super) struct PreparedPlanar {
    pub(super) drawings: Vec<PlanarDrawing>,
    /// Number of the drawing that the texture of a receiver shows.
    drawn: HashMap<Entity, (AssetId<Image>, u32)>,
}

/// The shadows of one receiver.
pub(super) struct PlanarDrawing {
    pub(super) ratio: TextureView,
    pub(super) mask: TextureView,
    pub(super) blurred: TextureView,
    pub(super) points: TextureView,
    pub(super) bind_group: Option<BindGroup>,
    /// Weighs the directions of the ambient light by the environment.
    pub(super) sky: Option<BindGroup>,
    pub(super) casters: Vec<CasterDraw>,
    pub(super) view_count: u32,
    pub(super) lights: Vec<LightDrawing>,
}

pub(super) struct LightDrawing {
    pub(super) views: Range<u32>,
    /// Blurs the mask across, unless the light is a point.
    pub(super) across: Option<BindGroup>,
    /// Blurs what that leaves, or the mask.
    pub(super) down: BindGroup,
}

/// Pipelines of planar shadows.
#[derive(SystemParam)]
pub(super) struct PlanarPipelines<'w> {
    shared: Res<'w, DepthPipeline>,
    mask: Res<'w, MaskPipeline>,
    masks: ResMut<'w, SpecializedMeshPipelines<MaskPipeline>>,
    blur: Res<'w, BlurPipelines>,
    sky: Res<'w, SkyPipeline>,
    sky_cells: ResMut<'w, SkyCells>,
    fallback: Res<'w, FallbackImage>,
}

/// Prepares receivers whose plan is another than what their texture shows, once all they need is there.
pub(super) fn prepare_planar(
    mut prepared: ResMut<PreparedPlanar>,
    plans: Option<Res<PlanarPlans>>,
    mut pipelines: PlanarPipelines,
    mut textures: ResMut<TextureCache>,
    assets: GpuAssets,
    gpu: Gpu,
) {
    prepared.drawings.clear();
    let Some(plans) = plans else {
        return;
    };
    prepared.drawn.retain(|receiver, _| plans.0.iter().any(|(_, plan)| plan.receiver == *receiver));
    for (drawing, plan) in &plans.0 {
        let wanted = (plan.texture, *drawing);
        if prepared.drawn.get(&plan.receiver) == Some(&wanted) {
            continue;
        }
        if let Some(ready) = prepare(plan, &mut pipelines, &mut textures, &assets, &gpu) {
            prepared.drawings.push(ready);
            prepared.drawn.insert(plan.receiver, wanted);
        }
    }
}

/// `None` while meshes, textures or pipelines are missing.
fn prepare(
    plan: &PlanarPlan,
    pipelines: &mut PlanarPipelines,
    textures: &mut TextureCache,
    assets: &GpuAssets,
    gpu: &Gpu,
) -> Option<PlanarDrawing> {
    let ratio = assets.images.get(plan.texture)?.texture_view.clone();
    let PlanarPipelines { shared, mask, masks, blur, sky, sky_cells, fallback } = pipelines;
    let mut buffers = CasterBuffers::default();
    let mut specialize = |key, layout: &_| masks.specialize(&gpu.pipeline_cache, mask, key, layout);
    let casters = caster_draws(&plan.casters, &mut buffers, &mut specialize, shared, assets, gpu).ok()?;
    let is_compiled = |id| gpu.pipeline_cache.get_render_pipeline(id).is_some();
    let needed = casters.iter().map(|draw| draw.pipeline).chain([blur.blur_across, blur.take_share]);
    // Bound to a name, so that all of them are queued at once.
    let missing = needed.filter(|id| !is_compiled(*id)).count();
    if missing > 0 || gpu.pipeline_cache.get_compute_pipeline(sky.weigh).is_none() {
        return None;
    }
    let view_count = plan.views.len() as u32;
    let views = gpu.storage_buffer("mirrorball_shadows_planar_views", plan.views.clone(), PlanarView::default());
    let bind_group = match casters.is_empty() {
        true => None,
        false => Some(buffers.bind(views.buffer()?, vec![view_count], &shared.layout, gpu)?),
    };
    let sky = bind_sky(plan, views.buffer()?, sky_cells, sky, assets, gpu)?;
    let environment = match &plan.environment {
        None => fallback.d2_array.texture_view.clone(),
        Some(environment) => cube_faces(&assets.images.get(environment.diffuse_map)?.texture),
    };
    let mut texture = |label, format| {
        let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
        textures.get(&gpu.device, descriptor(label, plan.edge, format, usage)).default_view
    };
    let mask = texture("mirrorball_shadows_planar_mask", MASK_FORMAT);
    let blurred = texture("mirrorball_shadows_planar_blurred", MASK_FORMAT);
    let points = texture("mirrorball_shadows_planar_points", STENCIL_FORMAT);
    let mut first = 0;
    let mut lights = Vec::new();
    for light in &plan.lights {
        let normal = plan.environment.map_or(Vec3::ZERO, |environment| environment.map_from_receiver * Vec3::Y);
        let mut uniform = UniformBuffer::from(uniform_of(light, normal, plan.strength));
        uniform.write_buffer(&gpu.device, &gpu.queue);
        let bind = |source: &TextureView| {
            let entries = BindGroupEntries::sequential((source, uniform.binding()?, &environment));
            Some(gpu.bind_group("mirrorball_shadows_planar_blur_bind_group", &blur.layout, &entries))
        };
        let is_blurred = light.blur.max_element() > 0.0;
        let across = if is_blurred { Some(bind(&mask)?) } else { None };
        let down = bind(if is_blurred { &blurred } else { &mask })?;
        lights.push(LightDrawing { views: first..first + light.views, across, down });
        first += light.views;
    }
    Some(PlanarDrawing { ratio, mask, blurred, points, bind_group, sky, casters, view_count, lights })
}

fn uniform_of(light: &PlannedLight, normal: Vec3, strength: f32) -> BlurUniform {
    let (share, normal) = match light.share {
        LightShare::Known(share) | LightShare::RestOfKnown(share) => (share, Vec3::ZERO),
        LightShare::Irradiance(share) | LightShare::RestOfIrradiance(share) => (share, normal),
    };
    let is_rest = light.share.is_rest().into();
    BlurUniform { share, sigma_across: light.blur.x, normal, sigma_down: light.blur.y, strength, is_rest }
}

fn descriptor(
    label: &'static str,
    edge: u32,
    format: TextureFormat,
    usage: TextureUsages,
) -> TextureDescriptor<'static> {
    TextureDescriptor {
        label: Some(label),
        size: Extent3d { width: edge, height: edge, ..default() },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    }
}
