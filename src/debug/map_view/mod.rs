//! Pictures of the environment's maps.

use crate::{
    camera::ArCamera,
    device::{self, Needs},
    environment_map::{self, EnvironmentCube, cube_faces},
    prefilter::FilteredEnvironment,
};
use bevy::{
    asset::{RenderAssetUsages, embedded_asset, load_embedded_asset},
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        Extract, ExtractSchedule, RenderApp, RenderStartup,
        diagnostic::RecordDiagnostics,
        render_asset::RenderAssets,
        render_resource::{
            BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId,
            ComputePassDescriptor, ComputePipelineDescriptor, Extent3d, PipelineCache, ShaderStages, ShaderType,
            StorageTextureAccess, TextureDimension, TextureFormat, TextureSampleType, TextureUsages, UniformBuffer,
            binding_types::{texture_2d_array, texture_storage_2d, uniform_buffer},
        },
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderGraphSystems, RenderQueue},
        texture::GpuImage,
    },
};

/// One of the maps that light the scene.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub enum ShownMap {
    /// What the probes have measured, linear camera units.
    #[default]
    Measured,
    /// How well each direction of it is known, 0…1 as gray.
    Confidence,
    /// Irradiance ÷ π by surface normal.
    Diffuse,
    /// Radiance by mirror direction at a level: of n levels, level m has perceptual roughness m / (n − 1). Levels beyond the last
    /// show the last.
    Glossy(u32),
}

/// A live equirectangular picture of one map, for panels and user interfaces: columns are the azimuth from −Z towards +X, rows run
/// from +Y down, linear color, clipped at 1.0. Of the first [`ArCamera`] or, without one, of the first lit camera or probe.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::debug::{MapView, ShownMap};
/// # fn setup(mut commands: Commands, mut images: ResMut<Assets<Image>>, mut materials: ResMut<Assets<StandardMaterial>>, screen: Entity) {
/// let view = MapView::new(ShownMap::Glossy(0), &mut images);
/// let surface = StandardMaterial { base_color_texture: Some(view.image.clone()), unlit: true, ..default() };
/// commands.entity(screen).insert((MeshMaterial3d(materials.add(surface)), view));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Debug, Clone)]
pub struct MapView {
    /// What is shown.
    pub map: ShownMap,
    /// The picture. Written by the GPU: do not change the asset behind it.
    pub image: Handle<Image>,
}

impl MapView {
    /// Width and height of the picture, in pixels.
    pub const SIZE: UVec2 = UVec2::new(192, 96);

    /// A view of a map, black until that exists.
    pub fn new(map: ShownMap, images: &mut Assets<Image>) -> Self {
        let extent = Extent3d { width: Self::SIZE.x, height: Self::SIZE.y, depth_or_array_layers: 1 };
        let format = TextureFormat::Rgba16Float;
        let mut image = Image::new_uninit(extent, TextureDimension::D2, format, RenderAssetUsages::RENDER_WORLD);
        image.texture_descriptor.label = Some("mirrorball_debug_map_view");
        image.texture_descriptor.usage =
            TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC;
        Self { map, image: images.add(image) }
    }
}

/// Draws [`MapView`]s. Costs nothing without any.
pub struct MapViewPlugin;

impl Plugin for MapViewPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<MapView>();
    }

    fn finish(&self, app: &mut App) {
        let needs = Needs {
            plugin: "MapViewPlugin",
            purpose: "environments will not be shown as pictures",
            storage_buffers: 0,
            storage_textures: 1,
        };
        if !device::can_draw(app, &needs) {
            return;
        }
        environment_map::load_shaders(app);
        embedded_asset!(app, "map_view.wgsl");
        app.sub_app_mut(RenderApp)
            .init_resource::<ExtractedViews>()
            .add_systems(RenderStartup, init_map_view_pipeline)
            .add_systems(ExtractSchedule, extract_views)
            .add_systems(RenderGraph, map_view_pass.in_set(RenderGraphSystems::Render).after(camera_driver));
    }
}

struct ExtractedView {
    map: AssetId<Image>,
    picture: AssetId<Image>,
    shown: ShownUniform,
}

#[derive(Resource, Default)]
struct ExtractedViews(Vec<ExtractedView>);

/// Mirror of `Shown` in `map_view.wgsl`.
#[derive(ShaderType, Clone, Copy)]
struct ShownUniform {
    level: u32,
    alpha: f32,
}

type Lit = (&'static FilteredEnvironment, Has<ArCamera>);

fn extract_views(
    mut extracted: ResMut<ExtractedViews>,
    views: Extract<Query<&MapView>>,
    measured: Extract<Query<&EnvironmentCube>>,
    lit: Extract<Query<Lit>>,
) {
    extracted.0.clear();
    let filtered = lit.iter().max_by_key(|(_, is_ar)| *is_ar).map(|(filtered, _)| filtered);
    extracted.0.extend(views.iter().filter_map(|view| {
        let (map, level) = match view.map {
            ShownMap::Measured | ShownMap::Confidence => (&measured.iter().next()?.0, 0),
            ShownMap::Diffuse => (&filtered?.diffuse, 0),
            ShownMap::Glossy(level) => (&filtered?.glossy, level),
        };
        let alpha = if view.map == ShownMap::Confidence { 1.0 } else { 0.0 };
        Some(ExtractedView { map: map.id(), picture: view.image.id(), shown: ShownUniform { level, alpha } })
    }));
}

#[derive(Resource)]
struct MapViewPipeline {
    layout: BindGroupLayoutDescriptor,
    id: CachedComputePipelineId,
}

fn init_map_view_pipeline(mut commands: Commands, asset_server: Res<AssetServer>, pipeline_cache: Res<PipelineCache>) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_debug_map_view_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_2d_array(TextureSampleType::Float { filterable: false }),
                uniform_buffer::<ShownUniform>(false),
                texture_storage_2d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly),
            ),
        ),
    );
    let id = pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
        label: Some("mirrorball_debug_map_view".into()),
        layout: vec![layout.clone()],
        shader: load_embedded_asset!(asset_server.as_ref(), "map_view.wgsl"),
        entry_point: Some("show".into()),
        ..default()
    });
    commands.insert_resource(MapViewPipeline { layout, id });
}

/// Threads along each side of a workgroup, as in the shader.
const WORKGROUP: u32 = 8;

fn map_view_pass(
    extracted: Res<ExtractedViews>,
    pipeline: Option<Res<MapViewPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut ctx: RenderContext,
) {
    let Some(MapViewPipeline { layout, id }) = pipeline.as_deref() else { return };
    let Some(ready) = pipeline_cache.get_compute_pipeline(*id).filter(|_| !extracted.0.is_empty()) else {
        return;
    };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.command_encoder().begin_compute_pass(&ComputePassDescriptor {
        label: Some("mirrorball_debug_map_view_pass"),
        timestamp_writes: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_debug_map_view");
    pass.set_pipeline(ready);
    for view in &extracted.0 {
        let (Some(map), Some(picture)) = (images.get(view.map), images.get(view.picture)) else {
            continue;
        };
        let last = map.texture.mip_level_count() - 1;
        let mut uniform = UniformBuffer::from(ShownUniform { level: view.shown.level.min(last), ..view.shown });
        uniform.set_label(Some("mirrorball_debug_map_view_uniform"));
        uniform.write_buffer(&device, &queue);
        let Some(binding) = uniform.binding() else { continue };
        let bind_group = device.create_bind_group(
            "mirrorball_debug_map_view_bind_group",
            &pipeline_cache.get_bind_group_layout(layout),
            &BindGroupEntries::sequential((&cube_faces(&map.texture), binding, &picture.texture_view)),
        );
        pass.set_bind_group(0, &bind_group, &[]);
        pass.dispatch_workgroups(MapView::SIZE.x.div_ceil(WORKGROUP), MapView::SIZE.y.div_ceil(WORKGROUP), 1);
    }
    span.end(&mut pass);
}
