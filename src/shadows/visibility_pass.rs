//! Once per sample of a camera's picture instead of once per fragment: which share of the light arrives there. Between the
//! camera's prepass and its main pass.

use super::{
    FilterKind,
    extract::ExtractedDome,
    textures::{DomeTextures, SHADOW_BINDINGS},
};
use bevy::{
    asset::{embedded_asset, load_embedded_asset},
    core_pipeline::{
        Core3d, Core3dSystems,
        prepass::{DepthPrepass, NormalPrepass, ViewPrepassTextures},
    },
    platform::collections::HashMap,
    prelude::*,
    render::{
        Render, RenderApp, RenderStartup, RenderSystems,
        diagnostic::RecordDiagnostics,
        extract_component::{ExtractComponent, ExtractComponentPlugin},
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId,
            ComputePassDescriptor, ComputePipelineDescriptor, PipelineCache, SamplerBindingType, ShaderStages,
            StorageTextureAccess, TextureFormat, TextureSampleType, TextureViewId,
            binding_types::{
                sampler, storage_buffer_read_only_sized, texture_2d, texture_2d_multisampled, texture_depth_2d,
                texture_depth_2d_multisampled, texture_storage_2d, uniform_buffer,
            },
        },
        renderer::{RenderContext, RenderDevice, ViewQuery},
        storage::GpuShaderBuffer,
        texture::GpuImage,
        view::{ViewUniform, ViewUniformOffset, ViewUniforms},
    },
    shader::ShaderDefVal,
};

/// Edge of a workgroup in samples; as in `visibility_pass.wgsl`.
const WORKGROUP: u32 = 8;
/// Bind group of the dome's bindings in this pass.
const DOME_GROUP: u32 = 1;

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "visibility_pass.wgsl");
    app.add_plugins(ExtractComponentPlugin::<ServedByDome>::default());
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app
        .init_resource::<DomeBindings>()
        .add_systems(RenderStartup, init_visibility_pipelines)
        .add_systems(Render, prepare_dome_bindings.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(Core3d, visibility_pass.after(Core3dSystems::Prepass).before(Core3dSystems::MainPass));
}

/// On the camera whose visibility is computed in a pass of its own.
#[derive(Component, ExtractComponent, Clone, Copy, Debug)]
pub(super) struct ServedByDome {
    /// Which of the prepasses this crate has asked for, and takes back when the camera is no longer served.
    pub(super) adds_depth: bool,
    pub(super) adds_normals: bool,
}

impl ServedByDome {
    /// Undoes what serving a camera has added to it.
    pub(super) fn release(self, camera: &mut EntityCommands) {
        camera.remove::<Self>();
        if self.adds_depth {
            camera.remove::<DepthPrepass>();
        }
        if self.adds_normals {
            camera.remove::<NormalPrepass>();
        }
    }
}

#[derive(Resource)]
struct VisibilityPipelines {
    dome_layout: BindGroupLayoutDescriptor,
    single: BindGroupLayoutDescriptor,
    multisampled: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
    /// By filter, and whether the prepass is multisampled.
    queued: HashMap<(FilterKind, bool), CachedComputePipelineId>,
}

fn init_visibility_pipelines(mut commands: Commands, asset_server: Res<AssetServer>) {
    let compute = ShaderStages::COMPUTE;
    let map = || texture_storage_2d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
    let unfiltered = TextureSampleType::Float { filterable: false };
    let [atlas, atlas_sampler, views, weights] = SHADOW_BINDINGS;
    commands.insert_resource(VisibilityPipelines {
        dome_layout: BindGroupLayoutDescriptor::new(
            "mirrorball_shadows_visibility_dome_layout",
            &BindGroupLayoutEntries::with_indices(
                compute,
                (
                    (atlas, texture_depth_2d()),
                    (atlas_sampler, sampler(SamplerBindingType::Comparison)),
                    (views, storage_buffer_read_only_sized(false, None)),
                    (weights, storage_buffer_read_only_sized(false, None)),
                ),
            ),
        ),
        single: BindGroupLayoutDescriptor::new(
            "mirrorball_shadows_visibility_layout",
            &BindGroupLayoutEntries::sequential(
                compute,
                (uniform_buffer::<ViewUniform>(true), texture_depth_2d(), texture_2d(unfiltered), map()),
            ),
        ),
        multisampled: BindGroupLayoutDescriptor::new(
            "mirrorball_shadows_visibility_multisampled_layout",
            &BindGroupLayoutEntries::sequential(
                compute,
                (
                    uniform_buffer::<ViewUniform>(true),
                    texture_depth_2d_multisampled(),
                    texture_2d_multisampled(unfiltered),
                    map(),
                ),
            ),
        ),
        shader: load_embedded_asset!(asset_server.as_ref(), "visibility_pass.wgsl"),
        queued: HashMap::default(),
    });
}

impl VisibilityPipelines {
    fn view_layout(&self, is_multisampled: bool) -> &BindGroupLayoutDescriptor {
        if is_multisampled { &self.multisampled } else { &self.single }
    }

    fn pipeline(
        &mut self,
        filter: FilterKind,
        is_multisampled: bool,
        cache: &PipelineCache,
    ) -> CachedComputePipelineId {
        let key = (filter, is_multisampled);
        if let Some(id) = self.queued.get(&key) {
            return *id;
        }
        let mut shader_defs = vec![ShaderDefVal::UInt("MATERIAL_BIND_GROUP".into(), DOME_GROUP)];
        shader_defs.extend(filter.shader_def());
        shader_defs.extend(is_multisampled.then(|| "MULTISAMPLED".into()));
        let id = cache.queue_compute_pipeline(ComputePipelineDescriptor {
            label: Some("mirrorball_shadows_visibility".into()),
            layout: vec![self.view_layout(is_multisampled).clone(), self.dome_layout.clone()],
            shader: self.shader.clone(),
            shader_defs,
            entry_point: Some("see".into()),
            ..default()
        });
        self.queued.insert(key, id);
        id
    }
}

/// The dome's bindings and what the pass needs besides, remade when what they were made from changes.
#[derive(Resource, Default)]
struct DomeBindings {
    bind_group: Option<BindGroup>,
    made_from: Option<(TextureViewId, AssetId<Image>)>,
    pipeline: Option<(CachedComputePipelineId, bool)>,
}

fn prepare_dome_bindings(
    mut prepared: ResMut<DomeBindings>,
    mut pipelines: ResMut<VisibilityPipelines>,
    dome: Res<ExtractedDome>,
    textures: Option<Res<DomeTextures>>,
    served: Query<&Msaa, With<ServedByDome>>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    device: Res<RenderDevice>,
) {
    prepared.pipeline = None;
    let (Some(textures), Some(msaa)) = (textures, served.iter().next()) else {
        return;
    };
    let (Some(atlas), Some(views), Some(weights)) =
        (images.get(&textures.atlas), buffers.get(&textures.views), buffers.get(&textures.weights))
    else {
        return;
    };
    let is_multisampled = msaa.samples() > 1;
    let pipeline = pipelines.pipeline(textures.filter, is_multisampled, &pipeline_cache);
    prepared.pipeline = (dome.fitted.direction_count() > 0).then_some((pipeline, is_multisampled));
    let made_from = Some((atlas.texture_view.id(), textures.atlas.id()));
    if prepared.bind_group.is_some() && prepared.made_from == made_from {
        return;
    }
    let [atlas_at, sampler_at, views_at, weights_at] = SHADOW_BINDINGS;
    prepared.bind_group = Some(device.create_bind_group(
        "mirrorball_shadows_visibility_dome_bind_group",
        &pipeline_cache.get_bind_group_layout(&pipelines.dome_layout),
        &BindGroupEntries::with_indices((
            (atlas_at, &atlas.texture_view),
            (sampler_at, &atlas.sampler),
            (views_at, views.buffer.as_entire_binding()),
            (weights_at, weights.buffer.as_entire_binding()),
        )),
    ));
    prepared.made_from = made_from;
}

fn visibility_pass(
    view: ViewQuery<(&ViewPrepassTextures, &ViewUniformOffset), With<ServedByDome>>,
    prepared: Res<DomeBindings>,
    pipelines: Res<VisibilityPipelines>,
    textures: Option<Res<DomeTextures>>,
    view_uniforms: Res<ViewUniforms>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let (prepass, view_offset) = view.into_inner();
    let (Some(textures), Some(dome), Some((pipeline, is_multisampled))) =
        (textures, &prepared.bind_group, prepared.pipeline)
    else {
        return;
    };
    let (Some(pipeline), Some(depth), Some(normal), Some(uniforms), Some(map)) = (
        pipeline_cache.get_compute_pipeline(pipeline),
        prepass.depth_view(),
        prepass.normal_view(),
        view_uniforms.uniforms.binding(),
        images.get(&textures.visibility),
    ) else {
        return;
    };
    let bind_group = device.create_bind_group(
        "mirrorball_shadows_visibility_bind_group",
        &pipeline_cache.get_bind_group_layout(pipelines.view_layout(is_multisampled)),
        &BindGroupEntries::sequential((uniforms, depth, normal, &map.texture_view)),
    );
    let size = map.texture_descriptor.size;
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.command_encoder().begin_compute_pass(&ComputePassDescriptor {
        label: Some("mirrorball_shadows_visibility_pass"),
        timestamp_writes: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_shadows_visibility");
    pass.set_pipeline(pipeline);
    pass.set_bind_group(0, &bind_group, &[view_offset.offset]);
    pass.set_bind_group(DOME_GROUP, dome, &[]);
    pass.dispatch_workgroups(size.width.div_ceil(WORKGROUP), size.height.div_ceil(WORKGROUP), 1);
    span.end(&mut pass);
}
