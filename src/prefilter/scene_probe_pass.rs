//! Pass that copies the faces of scene probes into their cubes, after all cameras.

use super::scene_probe::SceneCube;
use crate::environment_map::CubeWrites;
use bevy::{
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderSystems,
        render_asset::RenderAssets,
        render_resource::{Extent3d, Origin3d, TexelCopyTextureInfo},
        renderer::{RenderContext, RenderGraph, RenderGraphSystems},
        texture::GpuImage,
    },
};

pub(super) fn build(app: &mut App) {
    app.sub_app_mut(RenderApp)
        .init_resource::<SceneCopies>()
        .add_systems(ExtractSchedule, extract_scene_cubes)
        .add_systems(Render, announce_cubes.in_set(RenderSystems::PrepareResources))
        .add_systems(RenderGraph, copy_faces_pass.in_set(RenderGraphSystems::Render).after(camera_driver));
}

/// Copy of a face that is rendered in this frame.
struct FaceCopy {
    cube: AssetId<Image>,
    face: AssetId<Image>,
    layer: u32,
}

#[derive(Resource, Default)]
struct SceneCopies {
    copies: Vec<FaceCopy>,
    /// Cubes whose last face was copied. They are announced in the next frame, the first in which a filter can read
    /// them.
    finished: Vec<AssetId<Image>>,
}

fn extract_scene_cubes(mut scene: ResMut<SceneCopies>, cubes: Extract<Query<&SceneCube>>) {
    scene.copies.clear();
    for cube in &cubes {
        let (first, count) = cube.due;
        scene.copies.extend((0..count).map(|i| {
            let layer = (first + i) % 6;
            FaceCopy { cube: cube.cube.id(), face: cube.faces[layer].id(), layer: layer as u32 }
        }));
    }
}

fn announce_cubes(mut scene: ResMut<SceneCopies>, mut writes: ResMut<CubeWrites>, images: Res<RenderAssets<GpuImage>>) {
    writes.retain(|image| images.get(image).is_some());
    for cube in scene.finished.drain(..) {
        writes.announce(cube);
    }
}

fn copy_faces_pass(mut scene: ResMut<SceneCopies>, images: Res<RenderAssets<GpuImage>>, mut ctx: RenderContext) {
    let SceneCopies { copies, finished } = &mut *scene;
    for copy in copies {
        let (Some(face), Some(cube)) = (images.get(copy.face), images.get(copy.cube)) else {
            continue;
        };
        let size = face.texture.size();
        if (cube.texture.width(), cube.texture.height()) != (size.width, size.height) {
            continue;
        }
        ctx.command_encoder().copy_texture_to_texture(
            face.texture.as_image_copy(),
            TexelCopyTextureInfo { origin: Origin3d { x: 0, y: 0, z: copy.layer }, ..cube.texture.as_image_copy() },
            Extent3d { depth_or_array_layers: 1, ..size },
        );
        if copy.layer == 5 {
            finished.push(copy.cube);
        }
    }
}
