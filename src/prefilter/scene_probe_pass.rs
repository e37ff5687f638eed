//! Pass that copies the faces of scene probes, with their distances, into their cubes, after all cameras.

use super::scene_probe::{SceneCube, SceneProbe};
use crate::{
    compute_pass::{compute_pass, workgroups},
    environment_map::{CubeWrites, cube_faces},
};
use bevy::{
    asset::{embedded_asset, load_embedded_asset},
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId,
            ComputePipelineDescriptor, PipelineCache, ShaderStages, ShaderType, StorageTextureAccess, TextureFormat,
            TextureSampleType, UniformBuffer,
            binding_types::{texture_2d, texture_depth_2d, texture_storage_2d_array, uniform_buffer},
        },
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderGraphSystems, RenderQueue},
        sync_world::RenderEntity,
        texture::GpuImage,
        view::ViewDepthTexture,
    },
};

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "scene_probe_pass.wgsl");
    app.sub_app_mut(RenderApp)
        .init_resource::<SceneCopies>()
        .add_systems(RenderStartup, init_copy_pipeline)
        .add_systems(ExtractSchedule, extract_scene_cubes)
        .add_systems(Render, announce_cubes.in_set(RenderSystems::PrepareResources))
        .add_systems(RenderGraph, copy_faces_pass.in_set(RenderGraphSystems::Render).after(camera_driver));
}

/// Mirror of `Face` in `scene_probe_pass.wgsl`.
#[derive(ShaderType, Clone, Copy)]
struct FaceUniform {
    layer: u32,
    near: f32,
}

#[derive(Resource)]
struct CopyPipeline {
    id: CachedComputePipelineId,
    layout: BindGroupLayoutDescriptor,
}

fn init_copy_pipeline(mut commands: Commands, asset_server: Res<AssetServer>, pipeline_cache: Res<PipelineCache>) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_scene_probe_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_2d(TextureSampleType::Float { filterable: false }),
                texture_depth_2d(),
                uniform_buffer::<FaceUniform>(false),
                texture_storage_2d_array(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly),
            ),
        ),
    );
    let id = pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
        label: Some("mirrorball_scene_probe_copy".into()),
        layout: vec![layout.clone()],
        shader: load_embedded_asset!(asset_server.as_ref(), "scene_probe_pass.wgsl"),
        entry_point: Some("copy_face".into()),
        ..default()
    });
    commands.insert_resource(CopyPipeline { id, layout });
}

/// Copy of a face that is rendered in this frame.
struct FaceCopy {
    cube: AssetId<Image>,
    face: AssetId<Image>,
    camera: Entity,
    uniform: FaceUniform,
}

#[derive(Resource, Default)]
struct SceneCopies {
    copies: Vec<FaceCopy>,
    /// Cubes whose last face was copied. They are announced in the next frame, the first in which a filter can read
    /// them.
    finished: Vec<AssetId<Image>>,
}

fn extract_scene_cubes(
    mut scene: ResMut<SceneCopies>,
    cubes: Extract<Query<(&SceneProbe, &SceneCube)>>,
    cameras: Extract<Query<RenderEntity>>,
) {
    scene.copies.clear();
    for (probe, cube) in &cubes {
        let (first, count) = cube.due;
        scene.copies.extend((0..count).filter_map(|i| {
            let layer = (first + i) % 6;
            let camera = cameras.get(cube.cameras[layer]).ok()?;
            let uniform = FaceUniform { layer: layer as u32, near: probe.near_plane() };
            Some(FaceCopy { cube: cube.cube.id(), face: cube.faces[layer].id(), camera, uniform })
        }));
    }
}

fn announce_cubes(mut scene: ResMut<SceneCopies>, mut writes: ResMut<CubeWrites>, images: Res<RenderAssets<GpuImage>>) {
    writes.retain(|image| images.get(image).is_some());
    for cube in scene.finished.drain(..) {
        writes.announce(cube);
    }
}

fn copy_faces_pass(
    mut scene: ResMut<SceneCopies>,
    pipeline: Res<CopyPipeline>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    depths: Query<&ViewDepthTexture>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut ctx: RenderContext,
) {
    let SceneCopies { copies, finished } = &mut *scene;
    let Some(ready) = pipeline_cache.get_compute_pipeline(pipeline.id).filter(|_| !copies.is_empty()) else {
        return;
    };
    let layout = pipeline_cache.get_bind_group_layout(&pipeline.layout);
    let mut due: Vec<(BindGroup, u32)> = Vec::new();
    for copy in copies {
        let (Some(face), Some(cube), Ok(depth)) =
            (images.get(copy.face), images.get(copy.cube), depths.get(copy.camera))
        else {
            continue;
        };
        let edge = cube.texture.width();
        if face.texture.width() != edge || depth.texture.width() != edge {
            continue;
        }
        let mut uniform = UniformBuffer::from(copy.uniform);
        uniform.set_label(Some("mirrorball_scene_probe_uniform"));
        uniform.write_buffer(&device, &queue);
        let Some(uniform) = uniform.binding() else { continue };
        let layers = cube_faces(&cube.texture);
        let entries = BindGroupEntries::sequential((&face.texture_view, depth.view(), uniform, &layers));
        due.push((device.create_bind_group("mirrorball_scene_probe_bind_group", &layout, &entries), workgroups(edge)));
        if copy.uniform.layer == 5 {
            finished.push(copy.cube);
        }
    }
    compute_pass(&mut ctx, "mirrorball_scene_probe_copy", |pass| {
        pass.set_pipeline(ready);
        for (bind_group, across) in &due {
            pass.set_bind_group(0, bind_group, &[]);
            pass.dispatch_workgroups(*across, *across, 1);
        }
    });
}
