//! Cameras that render the faces of scene probes.

use super::{
    live_environment::LiveEnvironment,
    refresh::Refresh,
    scene_probe::{SceneCube, SceneProbe},
    update_environments::update_environments,
    viewing_camera::{ViewingCamera, unit_intensity},
};
use crate::{
    MirrorballSystems,
    environment_map::{EnvironmentCube, cube_image},
};
use bevy::{
    asset::RenderAssetUsages,
    camera::{
        Exposure, Hdr, ImageRenderTarget, RenderTarget,
        primitives::CUBE_MAP_FACES,
        visibility::{RenderLayers, VisibilitySystems},
    },
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    ecs::observer::On,
    light::Skybox,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages},
};

pub(super) fn build(app: &mut App) {
    app.add_observer(remove_faces)
        .add_systems(
            PreUpdate,
            (set_up_faces, schedule_faces).chain().before(update_environments).in_set(MirrorballSystems::Follow),
        )
        .add_systems(
            PostUpdate,
            place_faces.after(TransformSystems::Propagate).before(VisibilitySystems::UpdateFrusta),
        );
}

/// Camera of a face of a [`SceneProbe`].
#[derive(Component)]
pub(crate) struct SceneFace;

fn face_image(edge: u32) -> Image {
    let extent = Extent3d { width: edge, height: edge, depth_or_array_layers: 1 };
    let format = TextureFormat::Rgba16Float;
    let mut image = Image::new_uninit(extent, TextureDimension::D2, format, RenderAssetUsages::all());
    image.texture_descriptor.label = Some("mirrorball_scene_probe_face");
    image.texture_descriptor.usage =
        TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC;
    image
}

type Probe = (Entity, &'static SceneProbe, Option<&'static SceneCube>, Option<&'static LiveEnvironment>);

/// Allocates cameras and a cube for probes that have none of their size yet.
fn set_up_faces(mut commands: Commands, mut images: ResMut<Assets<Image>>, probes: Query<Probe>) {
    for (entity, probe, existing, environment) in &probes {
        let edge = probe.cube_edge();
        if existing.is_some_and(|existing| existing.edge == edge) {
            continue;
        }
        for camera in existing.iter().flat_map(|existing| existing.cameras) {
            commands.entity(camera).try_despawn();
        }
        let cube = images.add(cube_image("mirrorball_scene_probe_cube", edge, 1));
        let faces = std::array::from_fn(|_| images.add(face_image(edge)));
        let cameras = std::array::from_fn(|i| {
            let camera = (
                SceneFace,
                Name::new("scene probe face"),
                // The pass that copies the face into the cube reads its depth.
                Camera3d {
                    depth_texture_usages: (TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING).into(),
                    ..default()
                },
                Camera { order: -100, is_active: false, clear_color: Color::BLACK.into(), ..default() },
                RenderTarget::Image(ImageRenderTarget::from(Handle::clone(&faces[i]))),
                Hdr,
                Msaa::Off,
                Tonemapping::None,
                DebandDither::Disabled,
                Transform::default().looking_to(CUBE_MAP_FACES[i].target, CUBE_MAP_FACES[i].up),
            );
            commands.spawn(camera).id()
        });
        let is_ours = environment
            .is_none_or(|environment| existing.is_some_and(|existing| existing.cube.id() == environment.source.id()));
        if is_ours {
            let refresh = environment.map_or(Refresh::OnChange, |environment| environment.refresh);
            commands.entity(entity).insert(LiveEnvironment::new(cube.clone()).with_refresh(refresh));
        }
        commands.entity(entity).insert(SceneCube { cube, faces, cameras, edge, next: 0, due: (0, 0) });
    }
}

fn remove_faces(removed: On<Remove, SceneProbe>, cubes: Query<&SceneCube>, mut commands: Commands) {
    let Ok(cube) = cubes.get(removed.entity) else {
        return;
    };
    for camera in cube.cameras {
        commands.entity(camera).try_despawn();
    }
    if let Ok(mut entity) = commands.get_entity(removed.entity) {
        entity.try_remove::<(SceneCube, LiveEnvironment)>();
    }
}

type FaceCamera = (&'static mut Camera, &'static mut Projection, Option<&'static RenderLayers>);

/// Activates the faces that are due, and copies the settings that make them look like the main view.
fn schedule_faces(
    mut commands: Commands,
    mut probes: Query<(&SceneProbe, &mut SceneCube, Option<&RenderLayers>, Option<&Exposure>)>,
    mut cameras: Query<FaceCamera, With<SceneFace>>,
    skies: Query<(Option<&Skybox>, Option<&Exposure>), With<SceneFace>>,
    measured: Query<&EnvironmentCube>,
    viewing: ViewingCamera<Without<SceneFace>>,
) {
    for (probe, mut cube, layers, exposure) in &mut probes {
        let count = probe.faces_per_frame.min(6) as usize;
        cube.due = (cube.next, count);
        cube.next = (cube.next + count) % 6;
        let exposure = exposure.copied().unwrap_or_else(|| viewing.exposure());
        let background = probe.background.as_ref().or(measured.iter().next().map(|cube| &cube.0));
        for (face, camera) in cube.cameras.into_iter().enumerate() {
            let Ok((mut settings, mut projection, current_layers)) = cameras.get_mut(camera) else {
                continue;
            };
            let is_due = (face + 6 - cube.due.0) % 6 < count;
            if settings.is_active != is_due {
                settings.is_active = is_due;
            }
            if !is_due {
                continue;
            }
            let wanted = probe.projection();
            if let (Projection::Perspective(old), Projection::Perspective(new)) = (&*projection, &wanted)
                && (old.fov, old.near, old.far) != (new.fov, new.near, new.far)
            {
                *projection = wanted;
            }
            let mut camera = commands.entity(camera);
            match layers {
                Some(layers) if current_layers != Some(layers) => {
                    camera.insert(layers.clone());
                }
                None if current_layers.is_some() => {
                    camera.remove::<RenderLayers>();
                }
                _ => (),
            }
            let (sky, old_exposure) = skies.get(camera.id()).unwrap_or_default();
            let brightness = unit_intensity(Some(&exposure));
            if old_exposure.is_none_or(|old| old.ev100 != exposure.ev100) {
                camera.insert(exposure);
            }
            match background {
                Some(image) if sky.is_none_or(|s| s.image.as_ref() != Some(image) || s.brightness != brightness) => {
                    let sky = Skybox { image: Some(image.clone()), brightness, ..default() };
                    camera.insert((sky, LiveEnvironment::new(image.clone()).with_refresh(Refresh::OnChange)));
                }
                None if sky.is_some() => {
                    camera.remove::<(Skybox, LiveEnvironment)>();
                }
                _ => (),
            }
            if let Some(ambient) = viewing.ambient() {
                camera.insert(ambient);
            }
        }
    }
}

/// Moves the faces to their probe. Runs after transform propagation, so that the faces do not lag behind a moving
/// probe.
pub(crate) fn place_faces(
    probes: Query<(&SceneCube, &GlobalTransform), Without<SceneFace>>,
    mut cameras: Query<(&mut Transform, &mut GlobalTransform), With<SceneFace>>,
) {
    for (cube, probe) in &probes {
        for (camera, face) in cube.cameras.into_iter().zip(&CUBE_MAP_FACES) {
            if let Ok((mut transform, mut global)) = cameras.get_mut(camera) {
                let placed = Transform::from_translation(probe.translation()).looking_to(face.target, face.up);
                if *transform != placed {
                    *transform = placed;
                    *global = placed.into();
                }
            }
        }
    }
}
