//! Buffers and bind group of one source.

use super::{source_view::SourceView, unwrap_pipeline::UnwrapPipelines, unwrap_uniform::UnwrapUniform};
use crate::{
    environment_map::cube_faces,
    lighting::ClipGains,
    probe::{ProbeLens, SolidUniform},
};
use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, PipelineCache, StorageBuffer, TextureView, TextureViewId, UniformBuffer,
        },
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};

/// Buffers of one source, and what the cube was last made from.
pub(super) struct SourceBuffers {
    uniform: UniformBuffer<UnwrapUniform>,
    gains: StorageBuffer<Vec<Vec4>>,
    blockers: StorageBuffer<Vec<SolidUniform>>,
    shown: StorageBuffer<Vec<SolidUniform>>,
    /// The bind group, and the views of frame and cube that are in it.
    bind_group: Option<([TextureViewId; 2], BindGroup)>,
    /// Sequence number of the frame, and view.
    pub(super) made_from: Option<(u64, SourceView)>,
}

impl Default for SourceBuffers {
    fn default() -> Self {
        let numbers = ProbeLens::Equirect.numbers(UVec2::ONE);
        let mut uniform = UniformBuffer::from(UnwrapUniform::of_lens(numbers, Mat3::IDENTITY, Vec3::ONE));
        uniform.set_label(Some("mirrorball_probe_unwrap_uniform"));
        let mut gains = StorageBuffer::from(vec![Vec4::ZERO; ClipGains::COUNT]);
        gains.set_label(Some("mirrorball_probe_clip_gains"));
        Self {
            uniform,
            gains,
            blockers: solids_buffer(&[]),
            shown: solids_buffer(&[]),
            bind_group: None,
            made_from: None,
        }
    }
}

impl SourceBuffers {
    /// Whether the cube was last made from this frame.
    pub(super) fn has_frame(&self, sequence: u64) -> bool {
        self.made_from.as_ref().is_some_and(|(made_from, _)| *made_from == sequence)
    }

    /// Writes the uniform and what a view consists of.
    pub(super) fn write(
        &mut self,
        uniform: UnwrapUniform,
        view: &SourceView,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) {
        self.uniform.set(uniform);
        if let SourceView::Ball(_, gains, around) = view {
            if let Some(gains) = gains {
                self.gains.get_mut().copy_from_slice(&gains.0);
            }
            for (buffer, solids) in [(&mut self.blockers, &around.blockers), (&mut self.shown, &around.shown)] {
                // Shaders take a buffer's length for the number of boxes.
                if buffer.get().len() != solids.len().max(1) {
                    *buffer = solids_buffer(solids);
                    self.bind_group = None;
                } else if !solids.is_empty() {
                    buffer.get_mut().copy_from_slice(solids);
                }
            }
        }
        self.uniform.write_buffer(device, queue);
        for buffer in [&mut self.blockers, &mut self.shown] {
            buffer.write_buffer(device, queue);
        }
        self.gains.write_buffer(device, queue);
    }

    /// Bind group for a frame and a cube with its history. `None` while a buffer is missing.
    pub(super) fn bind_group(
        &mut self,
        [frame, cube]: [&GpuImage; 2],
        history: &TextureView,
        pipelines: &UnwrapPipelines,
        pipeline_cache: &PipelineCache,
        device: &RenderDevice,
    ) -> Option<BindGroup> {
        let views = [frame.texture_view.id(), cube.texture_view.id()];
        if let Some((of, bind_group)) = &self.bind_group
            && *of == views
        {
            return Some(bind_group.clone());
        }
        let bind_group = device.create_bind_group(
            "mirrorball_probe_unwrap_bind_group",
            &pipeline_cache.get_bind_group_layout(&pipelines.layout),
            &BindGroupEntries::sequential((
                &frame.texture_view,
                self.uniform.binding()?,
                self.gains.binding()?,
                self.blockers.binding()?,
                self.shown.binding()?,
                history,
                &cube_faces(&cube.texture),
            )),
        );
        self.bind_group = Some((views, bind_group.clone()));
        Some(bind_group)
    }
}

fn solids_buffer(solids: &[SolidUniform]) -> StorageBuffer<Vec<SolidUniform>> {
    let list = if solids.is_empty() { vec![SolidUniform::NOTHING] } else { solids.to_vec() };
    let mut buffer = StorageBuffer::from(list);
    buffer.set_label(Some("mirrorball_probe_solids"));
    buffer
}
