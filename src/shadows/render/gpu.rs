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
pub(in crate::shadows) struct Gpu<'w> {
    pub(in crate::shadows) device: Res<'w, RenderDevice>,
    pub(in crate::shadows) queue: Res<'w, RenderQueue>,
    pub(in crate::shadows) pipeline_cache: Res<'w, PipelineCache>,
}

impl Gpu<'_> {
    /// Returns a bind group with a layout of the pipeline cache.
    pub(in crate::shadows) fn bind_group(
        &self,
        label: &'static str,
        layout: &BindGroupLayoutDescriptor,
        entries: &[BindGroupEntry],
    ) -> BindGroup {
        self.device.create_bind_group(label, &self.pipeline_cache.get_bind_group_layout(layout), entries)
    }

    /// Returns a written storage buffer. It holds `filler` if there are no values, because an empty buffer cannot be
    /// bound.
    pub(in crate::shadows) fn storage_buffer<T: ShaderSize + WriteInto>(
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
pub(in crate::shadows) struct GpuAssets<'w> {
    pub(in crate::shadows) images: Res<'w, RenderAssets<GpuImage>>,
    pub(in crate::shadows) buffers: Res<'w, RenderAssets<GpuShaderBuffer>>,
    pub(in crate::shadows) meshes: Res<'w, RenderAssets<RenderMesh>>,
    pub(in crate::shadows) allocator: Res<'w, MeshAllocator>,
}
