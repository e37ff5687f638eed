//! The virtual scene around a point as an environment, so that moving virtual objects mirror each other and the room.

use super::{LiveEnvironment, Refresh, ViewingCamera, unit_intensity};
use crate::{
    MirrorballSystems,
    environment_map::{EnvironmentCube, cube_image},
};
use bevy::{
    asset::RenderAssetUsages,
    camera::{
        Exposure, Hdr, ImageRenderTarget, RenderTarget,
        visibility::{RenderLayers, VisibilitySystems},
    },
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    ecs::observer::On,
    light::Skybox,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages},
};
use std::f32::consts::FRAC_PI_2;

/// Renders the virtual scene around this entity into a cube, over the real environment, and lights the surroundings by it: put
/// it on a [`LightProbe`].
///
/// The faces follow the entity's place, not its turn or size. The cube gets into a [`LiveEnvironment`] on the same entity,
/// which is filtered anew when all six faces are (its [`refresh`](LiveEnvironment::refresh) may be changed). Each face is a whole
/// camera for the engine: [`faces_per_frame`](Self::faces_per_frame) bounds the cost.
///
/// What should not see itself, such as a mirror in whose middle the probe is, is kept out by [`RenderLayers`] on this entity:
/// they are those of the faces. The same goes for [phantoms](crate::phantom::PhantomObject), which show what the main camera sees
/// and nothing useful in other directions; lights have to be on a layer that the faces have, too. Mirrors that the probe sees
/// show its own last cube: light goes back and forth once per refresh, weaker each time as long as surfaces reflect less
/// than they receive.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_mirrorball::prefilter::SceneProbe;
///
/// fn setup(mut commands: Commands) {
///     commands.spawn((
///         LightProbe::default(),
///         SceneProbe { faces_per_frame: 2, ..default() },
///         // Lights everything within half a metre.
///         Transform::from_xyz(0.0, 0.2, 0.0).with_scale(Vec3::splat(1.0)),
///     ));
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Default, Debug, Clone)]
#[require(Transform, Visibility)]
pub struct SceneProbe {
    /// Edge length of a face in texels; the next power of two from 16 to 1024 is taken. Defaults to 128.
    pub edge: u32,
    /// Faces rendered in a frame, 0 (the cube stays as it is) to 6; more counts as 6. Defaults to 1: the cube is new after six
    /// frames.
    pub faces_per_frame: u32,
    /// Distance in metres from which things are seen; at least 0.0001. Defaults to 0.01.
    pub near: f32,
    /// Distance in metres up to which things are seen; more than `near`. Defaults to 100.
    pub far: f32,
    /// What is behind the virtual things and lights them: a cube map in frame buffer units, world axes. `None` takes the first
    /// measured [`EnvironmentCube`], or black where there is none. Defaults to `None`.
    pub background: Option<Handle<Image>>,
}

impl Default for SceneProbe {
    fn default() -> Self {
        Self { edge: 128, faces_per_frame: 1, near: 0.01, far: 100.0, background: None }
    }
}

impl SceneProbe {
    fn cube_edge(&self) -> u32 {
        self.edge.clamp(16, 1024).next_power_of_two()
    }

    fn projection(&self) -> Projection {
        let near = if self.near.is_finite() { self.near.max(1e-4) } else { 0.01 };
        let far = if self.far > near { self.far } else { 1e4 * near };
        PerspectiveProjection { fov: FRAC_PI_2, aspect_ratio: 1.0, near, far, ..default() }.into()
    }
}

/// What a [`SceneProbe`] has seen, on the same entity.
#[derive(Component, Clone, Debug)]
pub struct SceneCube {
    /// Cube map of 16-bit floats in frame buffer units, world axes. Written by the GPU: do not change the asset behind it.
    pub cube: Handle<Image>,
    pub(super) faces: [Handle<Image>; 6],
    cameras: [Entity; 6],
    edge: u32,
    /// The face that is rendered next.
    next: usize,
    /// Faces rendered in this frame: the first, and how many.
    pub(super) due: (usize, usize),
}

pub(super) fn build(app: &mut App) {
    app.register_type::<SceneProbe>()
        .add_observer(take_faces_away)
        .add_systems(
            PreUpdate,
            (set_up_faces, schedule_faces).chain().before(super::follow_sources).in_set(MirrorballSystems::Follow),
        )
        .add_systems(
            PostUpdate,
            place_faces.after(TransformSystems::Propagate).before(VisibilitySystems::UpdateFrusta),
        );
}

/// Camera of a face of a [`SceneProbe`].
#[derive(Component)]
struct SceneFace;

/// Where a camera looks and what is up for it, layer by layer of a cube in Bevy's convention.
const FACES: [(Vec3, Vec3); 6] = [
    (Vec3::X, Vec3::Y),
    (Vec3::NEG_X, Vec3::Y),
    (Vec3::Y, Vec3::Z),
    (Vec3::NEG_Y, Vec3::NEG_Z),
    (Vec3::NEG_Z, Vec3::Y),
    (Vec3::Z, Vec3::Y),
];

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

/// Gives cameras and a cube to probes that have none of their size yet.
fn set_up_faces(mut commands: Commands, mut images: ResMut<Assets<Image>>, probes: Query<Probe>) {
    for (entity, probe, existing, environment) in &probes {
        let edge = probe.cube_edge();
        if existing.is_some_and(|existing| existing.edge == edge) {
            continue;
        }
        for camera in existing.iter().flat_map(|existing| existing.cameras) {
            commands.entity(camera).try_despawn();
        }
        let mut cube = cube_image("mirrorball_scene_probe_cube", edge, 1);
        cube.texture_descriptor.usage |= TextureUsages::COPY_DST;
        let cube = images.add(cube);
        let faces = std::array::from_fn(|_| images.add(face_image(edge)));
        let cameras = std::array::from_fn(|i| {
            let camera = (
                SceneFace,
                Name::new("scene probe face"),
                Camera3d::default(),
                Camera { order: -100, is_active: false, clear_color: Color::BLACK.into(), ..default() },
                RenderTarget::Image(ImageRenderTarget::from(Handle::clone(&faces[i]))),
                Hdr,
                Msaa::Off,
                Tonemapping::None,
                DebandDither::Disabled,
                Transform::default().looking_to(FACES[i].0, FACES[i].1),
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

fn take_faces_away(removed: On<Remove, SceneProbe>, cubes: Query<&SceneCube>, mut commands: Commands) {
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

/// Switches on the faces that are due, and hands on what they need to look like the main view.
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

/// After all transforms are known, so that a moving probe does not lag behind.
fn place_faces(
    probes: Query<(&SceneCube, &GlobalTransform), Without<SceneFace>>,
    mut cameras: Query<(&mut Transform, &mut GlobalTransform), With<SceneFace>>,
) {
    for (cube, probe) in &probes {
        for (camera, (forward, up)) in cube.cameras.into_iter().zip(FACES) {
            if let Ok((mut transform, mut global)) = cameras.get_mut(camera) {
                let placed = Transform::from_translation(probe.translation()).looking_to(forward, up);
                if *transform != placed {
                    *transform = placed;
                    *global = placed.into();
                }
            }
        }
    }
}
