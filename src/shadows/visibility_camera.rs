//! The camera that has a visibility pass.

use super::{
    atlas::DomeTextures,
    dome_light::{ShadowDomeLight, VisibilitySamples},
};
use crate::camera::ArCamera;
use bevy::{
    core_pipeline::prepass::{DepthPrepass, NormalPrepass},
    ecs::{entity::EntityHashSet, query::QueryData},
    prelude::*,
    render::{extract_component::ExtractComponent, renderer::RenderDevice, storage::ShaderBuffer},
};

/// Marks the camera whose visibility is computed in a pass of its own.
#[derive(Component, ExtractComponent, Clone, Copy, Debug)]
pub(super) struct VisibilityCamera {
    /// Whether this crate has added the depth prepass. It is removed when the camera loses the visibility pass.
    adds_depth: bool,
    /// The same for the normal prepass.
    adds_normals: bool,
}

impl VisibilityCamera {
    /// Removes everything that was added to a camera for the visibility pass.
    fn release(self, camera: &mut EntityCommands) {
        camera.remove::<Self>();
        if self.adds_depth {
            camera.remove::<DepthPrepass>();
        }
        if self.adds_normals {
            camera.remove::<NormalPrepass>();
        }
    }
}

#[derive(QueryData)]
pub(super) struct CameraData {
    entity: Entity,
    camera: &'static Camera,
    is_ar: Has<ArCamera>,
    visibility: Option<&'static VisibilityCamera>,
    has_depth: Has<DepthPrepass>,
    has_normals: Has<NormalPrepass>,
}

/// Gives the visibility pass to the first active camera that shows the real world, or to the first active camera if
/// there is none, and fits the buffer of samples to it.
pub(super) fn choose_visibility_camera(
    mut commands: Commands,
    mut textures: ResMut<DomeTextures>,
    mut buffers: ResMut<Assets<ShaderBuffer>>,
    device: Res<RenderDevice>,
    domes: Query<&ShadowDomeLight>,
    cameras: Query<CameraData, With<Camera3d>>,
    mut warned: Local<EntityHashSet>,
) {
    let samples = domes.iter().next().map_or(VisibilitySamples::Fragment, |dome| dome.samples);
    let pixels = samples.pixels();
    let active = cameras.iter().filter(|item| item.camera.is_active && pixels > 0);
    let chosen = active.min_by_key(|item| (!item.is_ar, item.camera.order, item.entity));
    if let Some(chosen) = &chosen {
        let others = cameras.iter().filter(|item| item.is_ar && item.camera.is_active && item.entity != chosen.entity);
        for other in others.filter(|item| warned.insert(item.entity)) {
            warn!(
                "camera {}: the visibility pass of ShadowDomeLight serves one ArCamera, which is {}. This one sums the \
                 same shadows in every fragment, which takes longer. Give the camera that draws more the lower \
                 Camera::order",
                other.entity, chosen.entity
            );
        }
    }
    for item in &cameras {
        if let (Some(visibility), true) =
            (item.visibility, chosen.as_ref().is_none_or(|chosen| chosen.entity != item.entity))
        {
            visibility.release(&mut commands.entity(item.entity));
        }
    }
    let is_served = |item: &CameraDataItem| chosen.as_ref().is_some_and(|chosen| chosen.entity == item.entity);
    let has_prepass = |item: &CameraDataItem| item.camera.is_active && item.has_depth && item.has_normals;
    let samples_prepass = chosen.is_some() && !cameras.iter().any(|item| has_prepass(&item) && !is_served(&item));
    if textures.shader.samples_prepass != samples_prepass {
        textures.shader.samples_prepass = samples_prepass;
    }
    let (mut wanted, mut sample_pixels) = (UVec2::ONE, pixels);
    if let Some(chosen) = chosen {
        if chosen.visibility.is_none() {
            let visibility = VisibilityCamera { adds_depth: !chosen.has_depth, adds_normals: !chosen.has_normals };
            commands.entity(chosen.entity).insert((visibility, DepthPrepass, NormalPrepass));
        }
        if let Some(size) = chosen.camera.physical_target_size().filter(|size| size.min_element() > 0) {
            (wanted, sample_pixels) =
                DomeTextures::samples_for(size, pixels, device.limits().max_storage_buffer_binding_size);
        }
    }
    if textures.sample_pixels != sample_pixels {
        textures.sample_pixels = sample_pixels;
    }
    // An assignment without a change of size would still mark the textures as changed.
    if textures.visibility_size != wanted {
        textures.resize_visibility(wanted, &mut buffers);
    }
}
