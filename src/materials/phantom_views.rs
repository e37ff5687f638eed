//! The frame with which each view shows phantoms, as a bind group of the view.

use super::{
    PhantomMaterial, ShowPhantoms,
    phantom::{MAX_OCCLUDERS, PhantomUniform},
};
use crate::{
    camera::{
        ArCamera, CameraFrame, FrameMapping, FrameTexture, Intrinsics, MarksReal, camera_rank, motion_of_frame,
        world_from_camera,
    },
    shadows::DomeTextures,
};
use bevy::{
    ecs::{entity::EntityHashSet, system::SystemParam},
    math::Affine3A,
    prelude::*,
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderSystems,
        camera::TemporalJitter,
        render_asset::RenderAssets,
        render_resource::{
            AsBindGroup, BindGroup, BindGroupEntries, BufferId, PipelineCache, TextureViewId, UniformBuffer,
        },
        renderer::{RenderDevice, RenderQueue},
        storage::GpuShaderBuffer,
        sync_world::RenderEntity,
        texture::GpuImage,
    },
};

pub(super) fn build(app: &mut App) {
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        render_app
            .add_systems(ExtractSchedule, extract_phantom_views)
            .add_systems(Render, prepare_phantom_views.in_set(RenderSystems::PrepareBindGroups));
    }
}

/// Makes the environment of a camera with [`ShowPhantoms`] show phantoms where the projected frame does not.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub(super) struct BeyondFrame {
    /// Place from which the environment was captured.
    pub(super) captured_from: Vec3,
    /// Boxes −1…1 from world, of phantoms that may hide others from the camera of the frame; zeros for none.
    pub(super) occluders: [Mat4; MAX_OCCLUDERS],
}

/// Frame with which a view shows phantoms.
#[derive(Component)]
struct PhantomFrame {
    image: AssetId<Image>,
    uniform: PhantomUniform,
}

/// Bind group with which a view draws phantoms: that of [`PhantomMaterial`], with the frame of the view. Rebuilt only
/// when its inputs change.
#[derive(Component)]
pub(super) struct PhantomBindGroup {
    pub(super) bind_group: BindGroup,
    uniform: UniformBuffer<PhantomUniform>,
    made_from: PhantomResources,
}

/// Textures and buffers in a bind group.
type PhantomResources = ([TextureViewId; 2], [BufferId; 3]);

type FrameSource = (&'static ArCamera, &'static CameraFrame, &'static FrameTexture);
type ShowingCamera = (
    RenderEntity,
    &'static Camera,
    Option<FrameSource>,
    Option<(&'static ShowPhantoms, Option<&'static BeyondFrame>)>,
    Has<TemporalJitter>,
    Has<MarksReal>,
);
type Projector = (Entity, &'static Camera, FrameSource, &'static GlobalTransform);

fn extract_phantom_views(
    mut commands: Commands,
    cameras: Extract<Query<ShowingCamera, With<Camera3d>>>,
    projectors: Extract<Query<Projector>>,
    extracted: Query<Entity, With<PhantomFrame>>,
) {
    let mut current = EntityHashSet::default();
    for (view, camera, own, show, is_antialiased, marks_real) in &cameras {
        let motion = motion_of_frame(is_antialiased);
        let frame = match (own, show) {
            (Some((ar_camera, frame, texture)), _) => {
                let mapping = FrameMapping::frame_uv_from_viewport_uv(camera, ar_camera.fit, frame.pixels.size);
                mapping.map(|mapping| PhantomFrame {
                    image: texture.image.id(),
                    uniform: PhantomUniform {
                        alpha: if marks_real { 0.0 } else { 1.0 },
                        ..PhantomUniform::of_view(mapping, motion)
                    },
                })
            }
            (None, Some((show, beyond))) => match show.projector {
                Some(projector) => projectors.get(projector).ok(),
                None => projectors.iter().min_by_key(|(entity, camera, ..)| camera_rank(*entity, camera)),
            }
            .map(|(_, _, (ar_camera, frame, texture), place)| PhantomFrame {
                image: texture.image.id(),
                uniform: projected(&ar_camera.intrinsics_for(frame), &world_from_camera(place), beyond, motion),
            }),
            (None, None) => None,
        };
        if let Some(frame) = frame {
            commands.entity(view).insert(frame);
            current.insert(view);
        }
    }
    for view in extracted.iter().filter(|view| !current.contains(view)) {
        commands.entity(view).remove::<(PhantomFrame, PhantomBindGroup)>();
    }
}

/// Mapping of points in the world to the places where a camera shows them in its frame.
fn projected(
    intrinsics: &Intrinsics,
    world_from_camera: &Affine3A,
    beyond: Option<&BeyondFrame>,
    motion: Vec2,
) -> PhantomUniform {
    let size = intrinsics.size.as_vec2();
    let (scale, center) = (intrinsics.focal / size, intrinsics.center / size);
    let frame_uv_from_camera = Mat4::from_cols(
        Vec4::new(scale.x, 0.0, 0.0, 0.0),
        Vec4::new(0.0, -scale.y, 0.0, 0.0),
        Vec4::new(-center.x, -center.y, 0.0, -1.0),
        Vec4::ZERO,
    );
    PhantomUniform {
        frame_uv_from_view_uv: Vec4::ZERO,
        frame_uv_from_world: frame_uv_from_camera * Mat4::from(world_from_camera.inverse()),
        captured_from: beyond.map_or(Vec4::ZERO, |beyond| beyond.captured_from.extend(1.0)),
        projected_from: beyond.map_or(Vec4::ZERO, |_| world_from_camera.translation.extend(1.0)),
        occluders: beyond.map_or([Mat4::ZERO; MAX_OCCLUDERS], |beyond| beyond.occluders),
        motion,
        alpha: 1.0,
    }
}

/// What phantoms bind beside the frame.
#[derive(SystemParam)]
struct PhantomSurroundings<'w> {
    textures: Option<Res<'w, DomeTextures>>,
    images: Res<'w, RenderAssets<GpuImage>>,
    buffers: Res<'w, RenderAssets<GpuShaderBuffer>>,
}

fn prepare_phantom_views(
    mut commands: Commands,
    mut views: Query<(Entity, &PhantomFrame, Option<&mut PhantomBindGroup>)>,
    surroundings: PhantomSurroundings,
    pipeline_cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let PhantomSurroundings { textures, images, buffers } = surroundings;
    let Some(textures) = textures else {
        return;
    };
    let dome = [&textures.views, &textures.results, &textures.visibility].map(|buffer| buffers.get(buffer));
    let (Some(atlas), [Some(dome_views), Some(results), Some(visibility)]) = (images.get(&textures.atlas), dome) else {
        return;
    };
    for (entity, frame, mut prepared) in &mut views {
        let Some(image) = images.get(frame.image) else {
            continue;
        };
        let made_from = (
            [image.texture_view.id(), atlas.texture_view.id()],
            [&dome_views.buffer, &results.buffer, &visibility.buffer].map(|buffer| buffer.id()),
        );
        if let Some(prepared) = &mut prepared
            && prepared.made_from == made_from
        {
            if *prepared.uniform.get() != frame.uniform {
                prepared.uniform.set(frame.uniform);
                prepared.uniform.write_buffer(&device, &queue);
            }
            continue;
        }
        let mut uniform = UniformBuffer::from(frame.uniform);
        uniform.set_label(Some("mirrorball_materials_phantom_uniform"));
        uniform.write_buffer(&device, &queue);
        let Some(binding) = uniform.binding() else { continue };
        let layout = pipeline_cache.get_bind_group_layout(&PhantomMaterial::bind_group_layout_descriptor(&device));
        let entries = BindGroupEntries::with_indices((
            (0, &image.texture_view),
            (1, &image.sampler),
            (2, binding),
            (100, &atlas.texture_view),
            (101, &atlas.sampler),
            (102, dome_views.buffer.as_entire_binding()),
            (103, results.buffer.as_entire_binding()),
            (104, visibility.buffer.as_entire_binding()),
        ));
        let bind_group = device.create_bind_group("mirrorball_materials_phantom_bind_group", &layout, &entries);
        commands.entity(entity).insert(PhantomBindGroup { bind_group, uniform, made_from });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_projected_to_where_the_camera_shows_them() {
        let intrinsics = Intrinsics::new(Vec2::new(90.0, 80.0), Vec2::new(60.0, 30.0), UVec2::new(128, 64));
        let pose = Transform::from_xyz(0.3, 1.0, -0.2).looking_at(Vec3::new(0.1, 0.0, 0.3), Vec3::Y);
        let uniform = projected(&intrinsics, &pose.compute_affine(), None, Vec2::ZERO);
        for point in [Vec3::ZERO, Vec3::new(0.2, -0.1, 0.4), Vec3::new(-0.1, 0.2, 0.1)] {
            let uv = uniform.frame_uv_from_world * point.extend(1.0);
            let pixel = intrinsics.project(pose.compute_affine().inverse().transform_point3(point)).expect("in front");
            assert!((uv.xy() / uv.w).distance(pixel / intrinsics.size.as_vec2()) < 1e-5);
        }
    }
}
