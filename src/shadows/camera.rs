//! Which camera has a visibility pass, and the buffer it writes.

use super::{DomeTextures, ShadowDomeLight, VisibilitySamples, visibility_pass::ServedByDome};
use crate::camera::ArCamera;
use bevy::{
    asset::RenderAssetUsages,
    core_pipeline::prepass::{DepthPrepass, NormalPrepass},
    prelude::*,
    render::storage::ShaderBuffer,
};

/// A buffer for the shares of light that arrive at samples.
pub(super) fn visibility_buffer(size: UVec2) -> ShaderBuffer {
    let bytes = size.element_product() as usize * VISIBILITY_BYTES;
    ShaderBuffer::new(&vec![0; bytes], RenderAssetUsages::RENDER_WORLD)
}

/// Of a sample, in `visibility_pass.wgsl`.
const VISIBILITY_BYTES: usize = 8;

type CameraItem =
    (Entity, &'static Camera, Has<ArCamera>, Option<&'static ServedByDome>, Has<DepthPrepass>, Has<NormalPrepass>);

/// Chooses the camera: the first active one that shows the real world, else the first active one.
pub(super) fn serve_camera(
    mut commands: Commands,
    mut textures: ResMut<DomeTextures>,
    mut buffers: ResMut<Assets<ShaderBuffer>>,
    domes: Query<&ShadowDomeLight>,
    cameras: Query<CameraItem, With<Camera3d>>,
) {
    let samples = domes.iter().next().map_or(VisibilitySamples::Fragment, |dome| dome.samples);
    let pixels = samples.pixels();
    let active = cameras.iter().filter(|(_, camera, ..)| camera.is_active && pixels > 0);
    let chosen = active.min_by_key(|(entity, camera, is_ar, ..)| (!is_ar, camera.order, *entity));
    for (entity, _, _, served, ..) in &cameras {
        if let (Some(served), true) = (served, chosen.is_none_or(|(chosen, ..)| chosen != entity)) {
            served.release(&mut commands.entity(entity));
        }
    }
    let mut wanted = UVec2::ONE;
    if let Some((entity, camera, _, served, has_depth, has_normals)) = chosen {
        if served.is_none() {
            let served = ServedByDome { adds_depth: !has_depth, adds_normals: !has_normals };
            commands.entity(entity).insert((served, DepthPrepass, NormalPrepass));
        }
        if let Some(size) = camera.physical_target_size().filter(|size| size.min_element() > 0) {
            wanted = UVec2::new(size.x.div_ceil(pixels), size.y.div_ceil(pixels));
        }
    }
    if textures.visibility_size != wanted {
        textures.visibility = buffers.add(visibility_buffer(wanted));
        textures.visibility_size = wanted;
    }
}
