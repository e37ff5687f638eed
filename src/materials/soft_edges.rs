//! Edges of phantoms as soft as those of a camera's picture.

use bevy::{
    asset::{embedded_asset, load_embedded_asset},
    core_pipeline::{
        Core3d, Core3dSystems, FullscreenShader,
        prepass::{DepthPrepass, NormalPrepass, ViewPrepassTextures},
    },
    prelude::*,
    render::{
        Render, RenderApp, RenderStartup, RenderSystems,
        diagnostic::RecordDiagnostics,
        extract_component::{ExtractComponent, ExtractComponentPlugin},
        render_resource::{
            BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId,
            ColorTargetState, ColorWrites, FragmentState, Operations, PipelineCache, RenderPassColorAttachment,
            RenderPassDescriptor, RenderPipelineDescriptor, ShaderStages, ShaderType, SpecializedRenderPipeline,
            SpecializedRenderPipelines, TextureFormat, TextureSampleType, UniformBuffer, VertexState,
            binding_types::{
                texture_2d, texture_2d_multisampled, texture_depth_2d, texture_depth_2d_multisampled, uniform_buffer,
            },
        },
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        view::{ExtractedView, ViewTarget, ViewUniform, ViewUniformOffset, ViewUniforms},
    },
};

/// On an [`ArCamera`](crate::camera::ArCamera): virtual things fade into the phantoms that hide them instead of ending at a pixel.
///
/// A stand-in never has quite the outline of the real thing, and a camera's own edges are some pixels wide. Only edges where a
/// phantom is in front are softened; virtual things in front, and where they stand on phantoms, stay sharp. The camera gets a
/// depth and a normal prepass.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{materials::SoftPhantomEdges, prelude::*};
/// # fn setup(mut commands: Commands) {
/// commands.spawn((ArCamera::default(), CameraFeed::clip("assets/desk_clip"), SoftPhantomEdges { radius: 3.0 }));
/// # }
/// ```
///
/// Costs one pass over the picture with 32 reads of depth and normal per pixel. Hidden parts of virtual things are not drawn: they
/// continue in the colors of what is seen beside them. Transparent things are softened with what is behind them.
#[derive(Component, ExtractComponent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct SoftPhantomEdges {
    /// Half the width of an edge, in pixels, 0.5…16; what is outside counts as the nearer end. Defaults to 2.
    pub radius: f32,
}

impl SoftPhantomEdges {
    const RADIUS: std::ops::RangeInclusive<f32> = 0.5..=16.0;
}

impl Default for SoftPhantomEdges {
    fn default() -> Self {
        Self { radius: 2.0 }
    }
}

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "soft_edges.wgsl");
    app.register_type::<SoftPhantomEdges>()
        .add_plugins(ExtractComponentPlugin::<SoftPhantomEdges>::default())
        .add_systems(PostUpdate, ask_for_prepasses);
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app
        .init_resource::<SpecializedRenderPipelines<SoftEdgesPipeline>>()
        .add_systems(RenderStartup, init_soft_edges_pipeline)
        .add_systems(Render, prepare_soft_edges.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(Core3d, soft_edges_pass.in_set(Core3dSystems::EarlyPostProcess));
}

type WithoutPrepasses = (With<SoftPhantomEdges>, Or<(Without<DepthPrepass>, Without<NormalPrepass>)>);

fn ask_for_prepasses(mut commands: Commands, cameras: Query<Entity, WithoutPrepasses>) {
    for camera in &cameras {
        commands.entity(camera).insert((DepthPrepass, NormalPrepass));
    }
}

/// Mirror of `SoftEdges` in `soft_edges.wgsl`.
#[derive(ShaderType, Clone, Copy)]
struct SoftEdgesUniform {
    radius: f32,
}

/// What a view needs to soften its edges.
#[derive(Component)]
struct PreparedSoftEdges {
    pipeline: CachedRenderPipelineId,
    is_multisampled: bool,
    uniform: UniformBuffer<SoftEdgesUniform>,
    radius: f32,
}

#[derive(Resource)]
struct SoftEdgesPipeline {
    single: BindGroupLayoutDescriptor,
    multisampled: BindGroupLayoutDescriptor,
    vertex: VertexState,
    shader: Handle<Shader>,
}

fn init_soft_edges_pipeline(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    fullscreen_shader: Res<FullscreenShader>,
) {
    let (picture, normals) =
        (TextureSampleType::Float { filterable: true }, TextureSampleType::Float { filterable: false });
    let single = BindGroupLayoutEntries::sequential(
        ShaderStages::FRAGMENT,
        (
            uniform_buffer::<ViewUniform>(true),
            texture_2d(picture),
            texture_depth_2d(),
            texture_2d(normals),
            uniform_buffer::<SoftEdgesUniform>(false),
        ),
    );
    let multisampled = BindGroupLayoutEntries::sequential(
        ShaderStages::FRAGMENT,
        (
            uniform_buffer::<ViewUniform>(true),
            texture_2d(picture),
            texture_depth_2d_multisampled(),
            texture_2d_multisampled(normals),
            uniform_buffer::<SoftEdgesUniform>(false),
        ),
    );
    commands.insert_resource(SoftEdgesPipeline {
        single: BindGroupLayoutDescriptor::new("mirrorball_soft_edges_layout", &single),
        multisampled: BindGroupLayoutDescriptor::new("mirrorball_soft_edges_multisampled_layout", &multisampled),
        vertex: fullscreen_shader.to_vertex_state(),
        shader: load_embedded_asset!(asset_server.as_ref(), "soft_edges.wgsl"),
    });
}

impl SoftEdgesPipeline {
    fn layout(&self, is_multisampled: bool) -> &BindGroupLayoutDescriptor {
        if is_multisampled { &self.multisampled } else { &self.single }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct SoftEdgesPipelineKey {
    target_format: TextureFormat,
    is_multisampled: bool,
}

impl SpecializedRenderPipeline for SoftEdgesPipeline {
    type Key = SoftEdgesPipelineKey;

    fn specialize(&self, key: Self::Key) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            label: Some("mirrorball_soft_edges".into()),
            layout: vec![self.layout(key.is_multisampled).clone()],
            vertex: self.vertex.clone(),
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                shader_defs: key.is_multisampled.then(|| "MULTISAMPLED".into()).into_iter().collect(),
                entry_point: Some("soften".into()),
                targets: vec![Some(ColorTargetState {
                    format: key.target_format,
                    blend: None,
                    write_mask: ColorWrites::ALL,
                })],
            }),
            ..default()
        }
    }
}

type SoftView =
    (Entity, &'static SoftPhantomEdges, &'static ExtractedView, &'static Msaa, Option<&'static mut PreparedSoftEdges>);

fn prepare_soft_edges(
    mut commands: Commands,
    mut views: Query<SoftView>,
    pipeline: Res<SoftEdgesPipeline>,
    mut pipelines: ResMut<SpecializedRenderPipelines<SoftEdgesPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    for (entity, edges, view, msaa, prepared) in &mut views {
        let is_multisampled = msaa.samples() > 1;
        let key = SoftEdgesPipelineKey { target_format: view.target_format, is_multisampled };
        let id = pipelines.specialize(&pipeline_cache, &pipeline, key);
        let wanted = if edges.radius.is_nan() { SoftPhantomEdges::default().radius } else { edges.radius };
        let radius = wanted.clamp(*SoftPhantomEdges::RADIUS.start(), *SoftPhantomEdges::RADIUS.end());
        if let Some(mut prepared) = prepared {
            (prepared.pipeline, prepared.is_multisampled) = (id, is_multisampled);
            if prepared.radius != radius {
                prepared.radius = radius;
                prepared.uniform.set(SoftEdgesUniform { radius });
                prepared.uniform.write_buffer(&device, &queue);
            }
            continue;
        }
        let mut uniform = UniformBuffer::from(SoftEdgesUniform { radius });
        uniform.set_label(Some("mirrorball_soft_edges_uniform"));
        uniform.write_buffer(&device, &queue);
        commands.entity(entity).insert(PreparedSoftEdges { pipeline: id, is_multisampled, uniform, radius });
    }
}

type SoftenedView =
    (&'static ViewTarget, &'static ViewPrepassTextures, &'static ViewUniformOffset, &'static PreparedSoftEdges);

fn soft_edges_pass(
    view: ViewQuery<SoftenedView, With<SoftPhantomEdges>>,
    pipeline: Option<Res<SoftEdgesPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    view_uniforms: Res<ViewUniforms>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let (target, prepass, view_offset, prepared) = view.into_inner();
    let (Some(layouts), Some(ready), Some(depths), Some(normals), Some(view_uniform), Some(uniform)) = (
        pipeline,
        pipeline_cache.get_render_pipeline(prepared.pipeline),
        prepass.depth_view(),
        prepass.normal_view(),
        view_uniforms.uniforms.binding(),
        prepared.uniform.binding(),
    ) else {
        return;
    };
    let picture = target.post_process_write();
    let bind_group = device.create_bind_group(
        "mirrorball_soft_edges_bind_group",
        &pipeline_cache.get_bind_group_layout(layouts.layout(prepared.is_multisampled)),
        &BindGroupEntries::sequential((view_uniform, picture.source, depths, normals, uniform)),
    );
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("mirrorball_soft_edges_pass"),
        color_attachments: &[Some(RenderPassColorAttachment {
            view: picture.destination,
            depth_slice: None,
            resolve_target: None,
            ops: Operations::default(),
        })],
        depth_stencil_attachment: None,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_soft_edges");
    pass.set_render_pipeline(ready);
    pass.set_bind_group(0, &bind_group, &[view_offset.offset]);
    pass.draw(0..3, 0..1);
    span.end(&mut pass);
}
