//! Sums visibility × light once per sample of a camera's frame instead of once per fragment, between the camera's
//! prepass and its main pass.

use super::{
    prepare_visibility::{PreparedStep, PreparedVisibility, samples_extent},
    visibility_pipeline::{DOME_GROUP, Step},
};
use crate::{
    compute_pass::{compute_pass, workgroups},
    shadows::{atlas::DomeTextures, visibility_camera::VisibilityCamera},
};
use bevy::{
    core_pipeline::prepass::ViewPrepassTextures,
    prelude::*,
    render::{
        render_asset::RenderAssets,
        render_resource::{BindGroup, BindGroupEntries, BindingResource, PipelineCache, TextureView},
        renderer::{RenderContext, RenderDevice, ViewQuery},
        storage::GpuShaderBuffer,
        view::{ViewUniformOffset, ViewUniforms},
    },
};

pub(super) fn visibility_pass(
    view: ViewQuery<(&ViewPrepassTextures, &ViewUniformOffset), With<VisibilityCamera>>,
    prepared: Res<PreparedVisibility>,
    textures: Option<Res<DomeTextures>>,
    view_uniforms: Res<ViewUniforms>,
    pipeline_cache: Res<PipelineCache>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let (prepass, view_offset) = view.into_inner();
    let (Some(textures), Some(dome)) = (textures, &prepared.dome_bind_group) else {
        return;
    };
    let (Some(depths), Some(normals), Some(view), Some(visibility)) = (
        prepass.depth_view(),
        prepass.normal_view(),
        view_uniforms.uniforms.binding(),
        buffers.get(&textures.visibility),
    ) else {
        return;
    };
    let is_ready = |step: &PreparedStep| pipeline_cache.get_compute_pipeline(step.pipeline).is_some();
    if prepared.steps.is_empty() || !prepared.steps.iter().all(is_ready) {
        return;
    }
    let size = samples_extent(&textures);
    let bindings = StepBindings {
        view,
        depths,
        normals,
        visibility: visibility.buffer.as_entire_binding(),
        partial_sums: prepared.partial_sums.as_ref().map(|(_, view)| view),
    };
    compute_pass(&mut ctx, "mirrorball_shadows_visibility", |pass| {
        pass.set_bind_group(DOME_GROUP, dome, &[]);
        for step in &prepared.steps {
            let Some(pipeline) = pipeline_cache.get_compute_pipeline(step.pipeline) else { continue };
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &bindings.bind(step, &device), &[view_offset.offset]);
            pass.dispatch_workgroups(workgroups(size.width), workgroups(size.height), 1);
        }
    });
}

/// The bindings of all steps that belong to a view.
struct StepBindings<'a> {
    view: BindingResource<'a>,
    depths: &'a TextureView,
    normals: &'a TextureView,
    visibility: BindingResource<'a>,
    partial_sums: Option<&'a TextureView>,
}

impl StepBindings<'_> {
    /// Returns the bind group of one step.
    fn bind(&self, step: &PreparedStep, device: &RenderDevice) -> BindGroup {
        let label = "mirrorball_shadows_visibility_bind_group";
        let (view, depths, normals) = (self.view.clone(), self.depths, self.normals);
        let visibility = self.visibility.clone();
        match (step.step, self.partial_sums) {
            (Step::Gather, Some(partial_sums)) => device.create_bind_group(
                label,
                &step.layout,
                &BindGroupEntries::sequential((view, depths, normals, visibility, partial_sums)),
            ),
            (Step::Accumulate, Some(partial_sums)) => device.create_bind_group(
                label,
                &step.layout,
                &BindGroupEntries::sequential((view, depths, normals, partial_sums)),
            ),
            _ => device.create_bind_group(
                label,
                &step.layout,
                &BindGroupEntries::sequential((view, depths, normals, visibility)),
            ),
        }
    }
}
