//! System parameters that the render systems of the dome share.

use bevy::{
    ecs::system::SystemParam,
    prelude::*,
    render::{
        mesh::{RenderMesh, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutDescriptor, PipelineCache, ShaderSize, StorageBuffer,
            encase::internal::WriteInto,
        },
        renderer::{RenderDevice, RenderQueue},
        storage::GpuShaderBuffer,
        texture::GpuImage,
    },
};

/// Device, queue and compiled pipelines.
#[derive(SystemParam)]
pub(super) struct Gpu<'w> {
    pub(super) device: Res<'w, RenderDevice>,
    pub(super) queue: Res<'w, RenderQueue>,
    pub(super) pipeline_cache: Res<'w, PipelineCache>,
}

impl Gpu<'_> {
    /// Returns a bind group with a layout of the pipeline cache.
    pub(super) fn bind_group(
        &self,
        label: &'static str,
        layout: &BindGroupLayoutDescriptor,
        entries: &[BindGroupEntry],
    ) -> BindGroup {
        self.device.create_bind_group(label, &self.pipeline_cache.get_bind_group_layout(layout), entries)
    }

    /// Returns a written storage buffer. It holds `filler` if there are no values, because an empty buffer cannot be
    /// bound.
    pub(super) fn storage_buffer<T: ShaderSize + WriteInto>(
        &self,
        label: &'static str,
        mut values: Vec<T>,
        filler: T,
    ) -> StorageBuffer<Vec<T>> {
        if values.is_empty() {
            values.push(filler);
        }
        let mut buffer = StorageBuffer::from(values);
        buffer.set_label(Some(label));
        buffer.write_buffer(&self.device, &self.queue);
        buffer
    }
}

/// Images, buffers and meshes on the GPU.
#[derive(SystemParam)]
pub(super) struct GpuAssets<'w> {
    pub(super) images: Res<'w, RenderAssets<GpuImage>>,
    pub(super) buffers: Res<'w, RenderAssets<GpuShaderBuffer>>,
    pub(super) meshes: Res<'w, RenderAssets<RenderMesh>>,
    pub(super) allocator: Res<'w, MeshAllocator>,
}
