//! Bindings of the pass that weighs the directions of the ambient light.

use super::{
    super::{ambient, planned::PlanarPlan},
    sky_pipeline::{SkyPipeline, SkyUniform},
};
use crate::{
    environment_map::cube_faces,
    shadows::render::gpu::{Gpu, GpuAssets},
};
use bevy::{
    platform::collections::HashMap,
    prelude::*,
    render::render_resource::{BindGroup, BindGroupEntries, Buffer, StorageBuffer, UniformBuffer},
};

/// Cells of the sky by the number of directions.
#[derive(Resource, Default)]
pub(super) struct SkyCells(HashMap<u32, (StorageBuffer<Vec<Vec4>>, StorageBuffer<Vec<UVec2>>)>);

/// `None` while the map is missing, `Some(None)` if nothing is to be weighed.
pub(super) fn bind_sky(
    plan: &PlanarPlan,
    views: &Buffer,
    cells: &mut SkyCells,
    pipeline: &SkyPipeline,
    assets: &GpuAssets,
    gpu: &Gpu,
) -> Option<Option<BindGroup>> {
    let Some(environment) = plan.environment.filter(|_| plan.ambient > 0) else {
        return Some(None);
    };
    let map = assets.images.get(environment.specular_map)?;
    let (patches, ranges) = cells.0.entry(plan.ambient).or_insert_with(|| {
        let (patches, ranges) = ambient::cells(plan.ambient);
        (
            gpu.storage_buffer("mirrorball_shadows_planar_patches", patches, Vec4::ZERO),
            gpu.storage_buffer("mirrorball_shadows_planar_ranges", ranges, UVec2::ZERO),
        )
    });
    let level = ambient::level(map.texture_descriptor.size.width);
    let mut uniform = UniformBuffer::from(SkyUniform {
        map_from_receiver: Mat3::from_quat(environment.map_from_receiver),
        first_view: plan.views.len() as u32 - plan.ambient,
        count: plan.ambient,
        level: level.min(map.texture_descriptor.mip_level_count - 1),
    });
    uniform.write_buffer(&gpu.device, &gpu.queue);
    // A cone that holds no direction, where there are no lights.
    let no_cone = Vec4::new(0.0, 0.0, 0.0, 2.0);
    let cones = gpu.storage_buffer("mirrorball_shadows_planar_cones", plan.cones.clone(), no_cone);
    let faces = cube_faces(&map.texture);
    let entries = BindGroupEntries::sequential((
        &faces,
        uniform.binding()?,
        patches.binding()?,
        ranges.binding()?,
        cones.binding()?,
        views.as_entire_binding(),
    ));
    Some(Some(gpu.bind_group("mirrorball_shadows_planar_sky_bind_group", &pipeline.layout, &entries)))
}
