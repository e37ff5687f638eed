//! Once per sample of a camera's picture instead of once per fragment: which share of the light arrives there. Between the
//! camera's prepass and its main pass.

use super::{
    DomeShader, VisibilitySamples,
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
        extract_component::ExtractComponent,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            CachedComputePipelineId, ComputePassDescriptor, ComputePipelineDescriptor, Extent3d, PipelineCache,
            SamplerBindingType, ShaderStages, StorageTextureAccess, TextureDescriptor, TextureDimension, TextureFormat,
            TextureSampleType, TextureUsages, TextureView, TextureViewDescriptor, TextureViewId,
            binding_types::{
                sampler, storage_buffer_read_only_sized, storage_buffer_sized, texture_2d, texture_2d_multisampled,
                texture_depth_2d, texture_depth_2d_multisampled, texture_storage_2d, uniform_buffer,
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
    app.sub_app_mut(RenderApp)
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

/// What a dispatch does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Step {
    /// Everything, at each sample.
    See,
    /// A quarter of it.
    Tally,
    /// The rest from neighbors.
    Gather,
}

impl Step {
    fn of(samples: VisibilitySamples) -> &'static [Self] {
        if samples == VisibilitySamples::Interleaved { &[Self::Tally, Self::Gather] } else { &[Self::See] }
    }

    fn entry_point(self) -> &'static str {
        match self {
            Self::See => "see",
            Self::Tally => "tally",
            Self::Gather => "gather",
        }
    }

    fn shader_def(self) -> Option<ShaderDefVal> {
        (self != Self::See).then(|| self.entry_point().to_uppercase().into())
    }
}

#[derive(Resource)]
struct VisibilityPipelines {
    dome_layout: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
    /// By what is compiled, whether the prepass is multisampled, and what is done.
    queued: HashMap<(DomeShader, bool, Step), (CachedComputePipelineId, BindGroupLayout)>,
}

fn init_visibility_pipelines(mut commands: Commands, asset_server: Res<AssetServer>) {
    let [atlas, atlas_sampler, views, weights] = SHADOW_BINDINGS;
    commands.insert_resource(VisibilityPipelines {
        dome_layout: BindGroupLayoutDescriptor::new(
            "mirrorball_shadows_visibility_dome_layout",
            &BindGroupLayoutEntries::with_indices(
                ShaderStages::COMPUTE,
                (
                    (atlas, texture_depth_2d()),
                    (atlas_sampler, sampler(SamplerBindingType::Comparison)),
                    (views, storage_buffer_read_only_sized(false, None)),
                    (weights, storage_buffer_read_only_sized(false, None)),
                ),
            ),
        ),
        shader: load_embedded_asset!(asset_server.as_ref(), "visibility_pass.wgsl"),
        queued: HashMap::default(),
    });
}

/// Bindings of a step: the view, what the prepass has drawn, what is written, and of the last step what the first has written.
fn view_layout(is_multisampled: bool, step: Step) -> BindGroupLayoutDescriptor {
    let unfiltered = TextureSampleType::Float { filterable: false };
    let (depths, normals) = if is_multisampled {
        (texture_depth_2d_multisampled(), texture_2d_multisampled(unfiltered))
    } else {
        (texture_depth_2d(), texture_2d(unfiltered))
    };
    let written = if step == Step::Tally {
        texture_storage_2d(TALLY_FORMAT, StorageTextureAccess::WriteOnly)
    } else {
        storage_buffer_sized(false, None)
    };
    let shared = (uniform_buffer::<ViewUniform>(true), depths, normals, written);
    let compute = ShaderStages::COMPUTE;
    if step == Step::Gather {
        let (view, depths, normals, written) = shared;
        let read = texture_2d(TextureSampleType::Uint);
        let entries = BindGroupLayoutEntries::sequential(compute, (view, depths, normals, written, read));
        return BindGroupLayoutDescriptor::new("mirrorball_shadows_visibility_gather_layout", &entries);
    }
    let entries = BindGroupLayoutEntries::sequential(compute, shared);
    BindGroupLayoutDescriptor::new("mirrorball_shadows_visibility_layout", &entries)
}

impl VisibilityPipelines {
    fn pipeline(
        &mut self,
        shader: DomeShader,
        is_multisampled: bool,
        step: Step,
        cache: &PipelineCache,
    ) -> (CachedComputePipelineId, BindGroupLayout) {
        let queue = || {
            let mut shader_defs = vec![ShaderDefVal::UInt("MATERIAL_BIND_GROUP".into(), DOME_GROUP)];
            shader_defs.extend(shader.shader_defs());
            shader_defs.extend(step.shader_def());
            shader_defs.extend(is_multisampled.then(|| "MULTISAMPLED".into()));
            let layout = view_layout(is_multisampled, step);
            let bind_group_layout = cache.get_bind_group_layout(&layout);
            let id = cache.queue_compute_pipeline(ComputePipelineDescriptor {
                label: Some("mirrorball_shadows_visibility".into()),
                layout: vec![layout, self.dome_layout.clone()],
                shader: self.shader.clone(),
                shader_defs,
                entry_point: Some(step.entry_point().into()),
                ..default()
            });
            (id, bind_group_layout)
        };
        self.queued.entry((shader, is_multisampled, step)).or_insert_with(queue).clone()
    }
}

/// A sample's sums over a quarter of the directions, eight 16-bit floats.
const TALLY_FORMAT: TextureFormat = TextureFormat::Rgba32Uint;

fn samples_extent(textures: &DomeTextures) -> Extent3d {
    let UVec2 { x: width, y: height } = textures.visibility_size;
    Extent3d { width, height, depth_or_array_layers: 1 }
}

/// The dome's bindings and what the pass needs besides, remade when what they were made from changes.
#[derive(Resource, Default)]
struct DomeBindings {
    bind_group: Option<BindGroup>,
    made_from: Option<(TextureViewId, AssetId<Image>)>,
    steps: Vec<(Step, CachedComputePipelineId, BindGroupLayout)>,
    /// Between the two steps of interleaved samples, and its size.
    tallies: Option<(Extent3d, TextureView)>,
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
    prepared.steps.clear();
    let (Some(textures), Some(msaa)) = (textures, served.iter().next()) else {
        return;
    };
    let (Some(atlas), Some(views), Some(weights)) =
        (images.get(&textures.atlas), buffers.get(&textures.views), buffers.get(&textures.weights))
    else {
        return;
    };
    let is_multisampled = msaa.samples() > 1;
    if dome.fitted.direction_count() > 0 {
        for &step in Step::of(dome.fitted.samples) {
            let (pipeline, layout) = pipelines.pipeline(textures.shader, is_multisampled, step, &pipeline_cache);
            prepared.steps.push((step, pipeline, layout));
        }
    }
    let size = samples_extent(&textures);
    if dome.fitted.samples != VisibilitySamples::Interleaved {
        prepared.tallies = None;
    } else if prepared.tallies.as_ref().is_none_or(|(of, _)| *of != size) {
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("mirrorball_shadows_tallies"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TALLY_FORMAT,
            usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        prepared.tallies = Some((size, texture.create_view(&TextureViewDescriptor::default())));
    }
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
    textures: Option<Res<DomeTextures>>,
    view_uniforms: Res<ViewUniforms>,
    pipeline_cache: Res<PipelineCache>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let (prepass, view_offset) = view.into_inner();
    let (Some(textures), Some(dome)) = (textures, &prepared.bind_group) else {
        return;
    };
    let (Some(depth), Some(normal), Some(uniforms), Some(map)) = (
        prepass.depth_view(),
        prepass.normal_view(),
        view_uniforms.uniforms.binding(),
        buffers.get(&textures.visibility),
    ) else {
        return;
    };
    let ready = |(_, id, _): &(Step, CachedComputePipelineId, BindGroupLayout)| {
        pipeline_cache.get_compute_pipeline(*id).is_some()
    };
    if prepared.steps.is_empty() || !prepared.steps.iter().all(ready) {
        return;
    }
    let size = samples_extent(&textures);
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.command_encoder().begin_compute_pass(&ComputePassDescriptor {
        label: Some("mirrorball_shadows_visibility_pass"),
        timestamp_writes: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_shadows_visibility");
    pass.set_bind_group(DOME_GROUP, dome, &[]);
    for (step, id, layout) in &prepared.steps {
        let label = "mirrorball_shadows_visibility_bind_group";
        let tallies = prepared.tallies.as_ref().map(|(_, view)| view);
        let bind_group = match (step, tallies) {
            (Step::Gather, Some(tallies)) => device.create_bind_group(
                label,
                layout,
                &BindGroupEntries::sequential((
                    uniforms.clone(),
                    depth,
                    normal,
                    map.buffer.as_entire_binding(),
                    tallies,
                )),
            ),
            (Step::Tally, Some(tallies)) => device.create_bind_group(
                label,
                layout,
                &BindGroupEntries::sequential((uniforms.clone(), depth, normal, tallies)),
            ),
            _ => device.create_bind_group(
                label,
                layout,
                &BindGroupEntries::sequential((uniforms.clone(), depth, normal, map.buffer.as_entire_binding())),
            ),
        };
        let Some(pipeline) = pipeline_cache.get_compute_pipeline(*id) else { continue };
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &bind_group, &[view_offset.offset]);
        pass.dispatch_workgroups(size.width.div_ceil(WORKGROUP), size.height.div_ceil(WORKGROUP), 1);
    }
    span.end(&mut pass);
}
