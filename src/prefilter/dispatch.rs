//! Dispatches of the environment filter.

use super::filter_pipeline::{FilterPipelines, FilterStep};
use crate::compute_pass::workgroups;
use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindingResource, Buffer, CachedComputePipelineId, PipelineCache, ShaderType,
            Texture, UniformBuffer, encase::internal::WriteInto,
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

/// Texels per thread of the sums over blocks, as in `convolve.wgsl`.
const QUAD: u32 = 4;
/// Threads in a workgroup of the sums over blocks.
const QUAD_WORKGROUP: u32 = 64;
/// Threads in a workgroup that goes through padded faces row by row.
const ROW_WORKGROUP: u32 = 64;

/// One dispatch: pipeline, bindings, workgroups.
pub(super) struct Dispatch {
    pub(super) pipeline: CachedComputePipelineId,
    pub(super) bind_group: BindGroup,
    pub(super) groups: UVec3,
}

/// Factory of dispatches and of the buffers they read.
pub(super) struct DispatchBuilder<'a> {
    pub(super) pipelines: &'a FilterPipelines,
    pub(super) cache: &'a PipelineCache,
    pub(super) device: &'a RenderDevice,
    pub(super) queue: &'a RenderQueue,
}

impl DispatchBuilder<'_> {
    /// Dispatch of a step with its bindings, given as binding numbers and resources.
    pub(super) fn dispatch(&self, step: &FilterStep, bindings: &[(u32, BindingResource)], groups: UVec3) -> Dispatch {
        let entries: Vec<_> = bindings
            .iter()
            .map(|(binding, resource)| BindGroupEntry { binding: *binding, resource: resource.clone() })
            .collect();
        let layout = self.cache.get_bind_group_layout(&step.layout);
        let bind_group = self.device.create_bind_group("mirrorball_environment_bind_group", &layout, &entries);
        Dispatch { pipeline: step.id, bind_group, groups }
    }

    /// Uniform buffer with a value.
    pub(super) fn uniform<T: ShaderType + WriteInto>(&self, label: &'static str, value: T) -> Option<Buffer> {
        let mut buffer = UniformBuffer::from(value);
        buffer.set_label(Some(label));
        buffer.write_buffer(self.device, self.queue);
        buffer.buffer().cloned()
    }

    /// Binding of the sampler that interpolates within padded faces.
    pub(super) fn sampler(&self) -> BindingResource<'_> {
        BindingResource::Sampler(&self.pipelines.sampler)
    }
}

/// Workgroups with one thread per texel of a cube.
pub(super) fn texel_groups(edge: u32) -> UVec3 {
    UVec2::splat(workgroups(edge)).extend(6)
}

/// Quads of a cube face.
pub(super) fn face_quads(edge: u32) -> u32 {
    edge * edge / QUAD
}

/// Workgroups with one thread per quad.
pub(super) fn quad_groups(quads: u32) -> UVec3 {
    UVec3::new(quads.div_ceil(QUAD_WORKGROUP), 1, 1)
}

/// Workgroups with one thread per texel of padded faces.
pub(super) fn padded_groups(faces: &Texture) -> UVec3 {
    UVec3::new((faces.width() * faces.height()).div_ceil(ROW_WORKGROUP), 1, 6)
}
