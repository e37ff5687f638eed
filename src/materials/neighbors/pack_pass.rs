//! Pass that packs the maps of mirrors into the buffer that materials read, before all cameras.

use super::neighbor_cubes::{ExtractedMirrors, HEADER_TEXELS, MirrorEntry, extract_mirrors, header_bytes, level_count};
use crate::{
    MirrorballPasses,
    compute_pass::{compute_pass, workgroups},
    environment_map::cube_faces,
};
use bevy::{
    asset::load_embedded_asset,
    ecs::entity::EntityHashMap,
    prelude::*,
    render::{
        ExtractSchedule, RenderApp, RenderStartup,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BufferId,
            CachedComputePipelineId, ComputePipelineDescriptor, PipelineCache, ShaderStages, TextureSampleType,
            UniformBuffer,
            binding_types::{storage_buffer_sized, texture_2d_array, uniform_buffer},
        },
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderQueue},
        storage::GpuShaderBuffer,
        texture::GpuImage,
    },
};

pub(super) fn build(app: &mut App) {
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        render_app
            .init_resource::<ExtractedMirrors>()
            .add_systems(RenderStartup, init_pack_pipeline)
            .add_systems(ExtractSchedule, extract_mirrors)
            .add_systems(RenderGraph, pack_pass.in_set(MirrorballPasses::ReadCubes));
    }
}

#[derive(Resource)]
struct PackPipeline {
    id: CachedComputePipelineId,
    layout: BindGroupLayoutDescriptor,
}

fn init_pack_pipeline(mut commands: Commands, asset_server: Res<AssetServer>, pipeline_cache: Res<PipelineCache>) {
    let unfiltered = TextureSampleType::Float { filterable: false };
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_materials_pack_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_2d_array(unfiltered),
                texture_2d_array(unfiltered),
                uniform_buffer::<u32>(false),
                storage_buffer_sized(false, None),
            ),
        ),
    );
    let id = pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
        label: Some("mirrorball_materials_pack".into()),
        layout: vec![layout.clone()],
        shader: load_embedded_asset!(asset_server.as_ref(), "pack_pass.wgsl"),
        entry_point: Some("pack".into()),
        ..default()
    });
    commands.insert_resource(PackPipeline { id, layout });
}

/// What the buffer holds.
#[derive(Default)]
struct Packed {
    buffer: Option<BufferId>,
    /// Number of times that the maps of a probe have been packed.
    packs: EntityHashMap<u32>,
    entries: Vec<MirrorEntry>,
}

/// What packing reads and writes.
type PackTargets<'w> = (Res<'w, RenderAssets<GpuImage>>, Res<'w, RenderAssets<GpuShaderBuffer>>);

fn pack_pass(
    extracted: Res<ExtractedMirrors>,
    pipeline: Option<Res<PackPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    (images, buffers): PackTargets,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut packed: Local<Packed>,
    mut ctx: RenderContext,
) {
    let Some(pipeline) = pipeline else { return };
    let (Some(ready), Some(target)) = (pipeline_cache.get_compute_pipeline(pipeline.id), buffers.get(extracted.buffer))
    else {
        return;
    };
    if packed.buffer != Some(target.buffer.id()) {
        *packed = Packed { buffer: Some(target.buffer.id()), ..default() };
    }
    packed.packs.retain(|probe, _| extracted.mirrors.iter().any(|mirror| mirror.probe == *probe));
    let layout = pipeline_cache.get_bind_group_layout(&pipeline.layout);
    let mut due: Vec<(BindGroup, UVec3)> = Vec::new();
    for mirror in &extracted.mirrors {
        if packed.packs.get(&mirror.probe) == Some(&mirror.packs) {
            continue;
        }
        let (Some(specular), Some(scene)) = (images.get(mirror.specular), images.get(mirror.scene)) else {
            continue;
        };
        let edge = mirror.entry.edge;
        if specular.texture.width() != edge || scene.texture.width() != edge {
            continue;
        }
        let mut first_texel = UniformBuffer::from(HEADER_TEXELS + mirror.entry.first_texel);
        first_texel.set_label(Some("mirrorball_materials_pack_uniform"));
        first_texel.write_buffer(&device, &queue);
        let Some(first_texel) = first_texel.binding() else { continue };
        let (specular, scene) = (cube_faces(&specular.texture), cube_faces(&scene.texture));
        let entries = BindGroupEntries::sequential((&specular, &scene, first_texel, target.buffer.as_entire_binding()));
        let bind_group = device.create_bind_group("mirrorball_materials_pack_bind_group", &layout, &entries);
        let across = workgroups(edge + 2);
        due.push((bind_group, UVec3::new(across, across, 6 * level_count(edge))));
        packed.packs.insert(mirror.probe, mirror.packs);
    }
    let shown = extracted.mirrors.iter().filter(|mirror| packed.packs.contains_key(&mirror.probe));
    let entries: Vec<_> = shown.map(|mirror| mirror.entry).collect();
    if entries != packed.entries {
        queue.write_buffer(&target.buffer, 0, &header_bytes(&entries));
        packed.entries = entries;
    }
    if !due.is_empty() {
        compute_pass(&mut ctx, "mirrorball_materials_pack", |pass| {
            pass.set_pipeline(ready);
            for (bind_group, groups) in &due {
                pass.set_bind_group(0, bind_group, &[]);
                pass.dispatch_workgroups(groups.x, groups.y, groups.z);
            }
        });
    }
}
