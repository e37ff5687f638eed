//! The surfels on the GPU, and the buffers between the dispatches that light them.

use super::{
    extract::ExtractedDome,
    gpu::Gpu,
    surfel_pipeline::{SurfelPipelines, SurfelsUniform},
    visibility_pipeline::VisibilityPipelines,
};
use crate::shadows::{
    atlas::{DomeTextures, LIT_BYTES},
    bounce::{MAX_PHANTOMS, Surfel},
    dome_light::ShadowDomeLight,
};
use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, Buffer, BufferDescriptor, BufferUsages, CachedComputePipelineId, ShaderSize,
            UniformBuffer, encase::StorageBuffer,
        },
        renderer::RenderDevice,
    },
};
use std::sync::Arc;

/// Bytes of `Arriving` in `surfel_pass.wgsl`.
const ARRIVING_BYTES: u64 = 32;

/// What the surfel pass needs.
#[derive(Resource, Default)]
pub(super) struct PreparedSurfels {
    buffers: Option<SurfelBuffers>,
    pub(super) bind_group: Option<BindGroup>,
    made_from: Option<(SurfelsUniform, Arc<Vec<Surfel>>)>,
    pub(super) pipelines: Vec<CachedComputePipelineId>,
    pub(super) count: u32,
    pub(super) phantoms: u32,
    /// Whether the surfels differ from those that were lit last.
    pub(super) is_new: bool,
    /// Number of sums of the environment's light when the surfels were lit last.
    pub(super) lit_by: Option<u32>,
}

struct SurfelBuffers {
    surfels: Buffer,
    arriving: Buffer,
    albedos: Buffer,
    lit: Buffer,
}

impl SurfelBuffers {
    fn new(device: &RenderDevice) -> Self {
        let buffer = |label, size, usage| {
            let usage = usage | BufferUsages::STORAGE;
            device.create_buffer(&BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let count = u64::from(ShadowDomeLight::MAX_SURFELS);
        let none = BufferUsages::empty();
        Self {
            surfels: buffer("mirrorball_shadows_surfels", count * Surfel::SHADER_SIZE.get(), BufferUsages::COPY_DST),
            arriving: buffer("mirrorball_shadows_surfels_arriving", count * ARRIVING_BYTES, none),
            albedos: buffer("mirrorball_shadows_surfels_albedos", 16 * MAX_PHANTOMS as u64, none),
            lit: buffer("mirrorball_shadows_surfels_lit", LIT_BYTES as u64, BufferUsages::COPY_SRC),
        }
    }
}

impl PreparedSurfels {
    /// Buffer with the surfels that were lit (`LitSurfels` in `dome.wgsl`).
    pub(super) fn lit(&self) -> Option<&Buffer> {
        self.buffers.as_ref().map(|buffers| &buffers.lit)
    }
}

pub(super) fn prepare_surfels(
    mut prepared: ResMut<PreparedSurfels>,
    mut pipelines: ResMut<SurfelPipelines>,
    visibility: Res<VisibilityPipelines>,
    dome: Res<ExtractedDome>,
    textures: Option<Res<DomeTextures>>,
    gpu: Gpu,
) {
    let Some(textures) = textures.filter(|_| dome.fitted.direction_count() > 0) else {
        return;
    };
    let prepared = &mut *prepared;
    prepared.pipelines = pipelines.of(textures.shader, &visibility.dome_layout, &gpu.pipeline_cache).to_vec();
    let uniform = SurfelsUniform {
        up: dome.fitted.world_from_dome * Vec3::Y,
        count: dome.surfels.list.len() as u32,
        covers_phantoms: dome.surfels.covers_phantoms.into(),
        has_horizon: (!dome.fitted.directions.below.is_empty()).into(),
    };
    let is_same =
        |(last, list): &(SurfelsUniform, Arc<Vec<Surfel>>)| *last == uniform && Arc::ptr_eq(list, &dome.surfels.list);
    if prepared.bind_group.is_some() && prepared.made_from.as_ref().is_some_and(is_same) {
        return;
    }
    let buffers = prepared.buffers.get_or_insert_with(|| SurfelBuffers::new(&gpu.device));
    let mut bytes = StorageBuffer::new(Vec::<u8>::new());
    if let Err(error) = bytes.write(&*dome.surfels.list) {
        error_once!("cannot lay out the surfels of the dome: {error}");
        return;
    }
    gpu.queue.write_buffer(&buffers.surfels, 0, bytes.as_ref());
    let mut uniform_buffer = UniformBuffer::from(uniform);
    uniform_buffer.set_label(Some("mirrorball_shadows_surfels_uniform"));
    uniform_buffer.write_buffer(&gpu.device, &gpu.queue);
    let Some(uniforms) = uniform_buffer.binding() else {
        return;
    };
    let entries = BindGroupEntries::sequential((
        uniforms,
        buffers.surfels.as_entire_binding(),
        buffers.arriving.as_entire_binding(),
        buffers.albedos.as_entire_binding(),
        buffers.lit.as_entire_binding(),
    ));
    prepared.bind_group = Some(gpu.bind_group("mirrorball_shadows_surfels_bind_group", &pipelines.layout, &entries));
    prepared.made_from = Some((uniform, Arc::clone(&dome.surfels.list)));
    (prepared.count, prepared.phantoms, prepared.is_new) = (uniform.count, dome.surfels.phantoms, true);
}
