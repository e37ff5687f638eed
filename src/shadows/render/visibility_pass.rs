//! Sums visibility × light once per sample of a camera's frame instead of once per fragment, between the camera's
//! prepass and its main pass.

use super::{
    extract::ExtractedDome,
    prepare_views::DomeViews,
    prepare_visibility::PreparedVisibility,
    prepare_weights::PreparedWeights,
    visibility_cache::{FRESH_GROUPS_OFFSET, LookupSources},
    visibility_pipeline::{DOME_GROUP, GROUPS_GROUP, Step, VisibilityPipelines},
};
use crate::{
    compute_pass::{compute_pass, workgroups},
    shadows::{atlas::DomeTextures, visibility_camera::VisibilityCamera},
};
use bevy::{
    camera::MainPassResolutionOverride,
    core_pipeline::prepass::ViewPrepassTextures,
    prelude::*,
    render::{
        camera::TemporalJitter,
        render_asset::RenderAssets,
        render_resource::{BindGroupEntries, ComputePass, PipelineCache},
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        storage::GpuShaderBuffer,
        view::{ViewUniformOffset, ViewUniforms},
    },
};

type VisibilityView = (
    &'static ViewPrepassTextures,
    &'static ViewUniformOffset,
    Has<TemporalJitter>,
    Option<&'static MainPassResolutionOverride>,
);

pub(super) fn visibility_pass(
    view: ViewQuery<VisibilityView, With<VisibilityCamera>>,
    mut prepared: ResMut<PreparedVisibility>,
    mut dome_views: ResMut<DomeViews>,
    dome: Res<ExtractedDome>,
    weights: Res<PreparedWeights>,
    textures: Option<Res<DomeTextures>>,
    pipelines: Res<VisibilityPipelines>,
    view_uniforms: Res<ViewUniforms>,
    pipeline_cache: Res<PipelineCache>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut ctx: RenderContext,
) {
    let (prepass, view_offset, is_jittered, resolution) = view.into_inner();
    let prepared = &mut *prepared;
    let (Some(textures), Some(dome_bind_group), Some(shader)) = (textures, &prepared.dome_bind_group, prepared.shader)
    else {
        return;
    };
    let (Some(depths), Some(normals), Some(view), Some(samples), Some(partial_sums)) = (
        prepass.depth_view(),
        prepass.normal_view(),
        view_uniforms.uniforms.binding(),
        buffers.get(&textures.visibility),
        &prepared.partial_sums,
    ) else {
        return;
    };
    let ready = |id| pipeline_cache.get_compute_pipeline(id);
    if prepared.steps.is_empty() || !prepared.steps.iter().all(|(_, id)| ready(*id).is_some()) {
        return;
    }
    let pipeline = |step| prepared.steps.iter().find(|(other, _)| *other == step).and_then(|(_, id)| ready(*id));
    let layout = pipeline_cache.get_bind_group_layout(&shader.layout());
    let label = "mirrorball_shadows_visibility_bind_group";
    let (sample_buffer, partial_sums) = (samples.buffer.as_entire_binding(), partial_sums.as_entire_binding());
    let Some(cache) = &mut prepared.cache else {
        let entries = BindGroupEntries::sequential((view, depths, normals, sample_buffer, partial_sums));
        let bind_group = device.create_bind_group(label, &layout, &entries);
        compute_pass(&mut ctx, "mirrorball_shadows_visibility", |pass| {
            pass.set_bind_group(0, &bind_group, &[view_offset.offset]);
            pass.set_bind_group(DOME_GROUP, dome_bind_group, &[]);
            for pipeline in [Step::Accumulate, Step::Gather].into_iter().filter_map(pipeline) {
                pass.set_pipeline(pipeline);
                dispatch_all(pass, &textures);
            }
        });
        return;
    };
    // A jittered prepass shows other points in every frame.
    dome_views.redrawn.all |= is_jittered;
    let sources = LookupSources {
        prepass: [depths.id(), normals.id()],
        atlas: textures.atlas.id(),
        samples: samples.buffer.id(),
        resolution: resolution.map(|size| size.0),
    };
    let changes = cache.follow(sources, weights.sums, &dome.fitted, &mut dome_views, &queue);
    let kept = (&cache.lookups, &cache.plan, &cache.changes);
    let entries = BindGroupEntries::sequential((
        view,
        depths,
        normals,
        sample_buffer,
        partial_sums,
        kept.0.as_entire_binding(),
        kept.1.as_entire_binding(),
        kept.2.as_entire_binding(),
    ));
    let bind_group = device.create_bind_group(label, &layout, &entries);
    let groups_bind_group = device.create_bind_group(
        "mirrorball_shadows_visibility_groups_bind_group",
        &pipeline_cache.get_bind_group_layout(&pipelines.groups_layout),
        &BindGroupEntries::single(cache.groups.as_entire_binding()),
    );
    compute_pass(&mut ctx, "mirrorball_shadows_visibility", |pass| {
        pass.set_bind_group(0, &bind_group, &[view_offset.offset]);
        pass.set_bind_group(DOME_GROUP, dome_bind_group, &[]);
        pass.set_bind_group(GROUPS_GROUP, &groups_bind_group, &[]);
        let run = |pass: &mut ComputePass, step, dispatch: &dyn Fn(&mut ComputePass)| {
            if let Some(pipeline) = pipeline(step) {
                pass.set_pipeline(pipeline);
                dispatch(pass);
            }
        };
        let everywhere = |pass: &mut ComputePass| dispatch_all(pass, &textures);
        let in_listed_tiles = |pass: &mut ComputePass| pass.dispatch_workgroups_indirect(&cache.groups, 0);
        run(pass, Step::Plan, &|pass| pass.dispatch_workgroups(1, 1, 1));
        run(pass, Step::FindChanges, &everywhere);
        run(pass, Step::LookUp, &in_listed_tiles);
        if changes.has_keys() {
            run(pass, Step::LookUpKeys, &in_listed_tiles);
        }
        if changes.has_fresh() {
            run(pass, Step::LookUpFresh, &|pass| {
                pass.dispatch_workgroups_indirect(&cache.groups, FRESH_GROUPS_OFFSET);
            });
        }
        if changes.has_fresh_keys() {
            run(pass, Step::LookUpFreshKeys, &everywhere);
        }
        for step in [Step::Accumulate, Step::Gather] {
            if changes.sums_all() { run(pass, step, &everywhere) } else { run(pass, step, &in_listed_tiles) }
        }
    });
}

/// Dispatches one thread per sample.
fn dispatch_all(pass: &mut ComputePass, textures: &DomeTextures) {
    let size = textures.visibility_size;
    pass.dispatch_workgroups(workgroups(size.x), workgroups(size.y), 1);
}
