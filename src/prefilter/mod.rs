//! Raw environment → diffuse and glossy maps that light every `StandardMaterial`.
//!
//! **Enters:** an [`EnvironmentCube`], or any cube map, equirectangular picture or render target that a game puts into a
//! [`LiveEnvironment`], on a camera or on a light probe; nothing else of this crate is needed. **Leaves:** a normal
//! [`EnvironmentMapLight`] on the same entity, at the intensity that makes 1.0 in the source 1.0 in the frame buffer.
//!
//! The diffuse map is the cosine-weighted sum of all light and the rough glossy levels are whole sums of GGX, both over 6·8²
//! blocks at their energy centroids. The sharp levels are rings of taps into a pyramid of splines (after Manson & Sloan 2016,
//! *Fast Filtering of Reflection Probes*) whose shares are fitted to the lobe for each level, and a share of the next rougher
//! level: the far tails of GGX are alike whatever the roughness. Each ring reads a cube of its own, the pyramid made equally sharp
//! everywhere: that takes the search for levels out of the taps, and small lamps show no more of where between texels they lie. All are
//! free of noise. [`Refresh`] says when they are made anew.
//!
//! # Cost
//! For each refresh, beside those of Bevy's `GeneratedEnvironmentMapLight` (read in its sources), which does this every frame:
//!
//! | | ours, 128² | Bevy, 128² | ours, 256² | Bevy, 256² |
//! |---|---|---|---|---|
//! | texels loaded | 0.25 M | 0.2 M | 0.9 M | 0.8 M |
//! | filtered lookups | 0.6 M | 7.7 M | 2.3 M | 12.1 M |
//! | products of a block and a lobe | 1.95 M | – | 1.95 M | – |
//! | dispatches | 17 | 12 | 21 | 13 |
//! | bytes written | 1.8 MB | 2.1 MB | 6.8 MB | 8.4 MB |
//! | bind groups made | 0 | all | 0 | all |
//!
//! Ours are lookups in flat faces with a texel of their neighbors around, not in cubes, so that nothing hangs on how a driver looks across
//! edges. Nothing is allocated for a refresh; bind groups, tables and buffers are made when a source arrives or changes its size.
//! `benches/environment.rs` measures time and truth of both.
//!
//! # More than light from afar
//! A [`SceneProbe`] makes a source of the virtual scene itself, over the measured room. [`DeskParallax`] lets a probe mirror
//! the part of the desk that is under it. [`CubePixels::harmonics`](crate::environment_map::CubePixels::harmonics)
//! is an environment in nine numbers for code on the CPU.
//!
//! # Files
//! Radiance and OpenEXR files become light, and measured light becomes a file:
//!
//! ```no_run
//! # use bevy::prelude::*;
//! # use bevy_mirrorball::{environment_map::{CubePixels, EnvironmentFileError, EquirectPixels}, prelude::*};
//! # fn example(camera: Entity, mut commands: Commands, mut images: ResMut<Assets<Image>>, measured: CubePixels)
//! # -> Result<(), EnvironmentFileError> {
//! let cube = EquirectPixels::open("studio.hdr")?.to_cube(128, Quat::IDENTITY);
//! commands.entity(camera).insert(LiveEnvironment::new(images.add(cube.to_image())));
//!
//! measured.to_equirect(1024, Quat::IDENTITY).save("my_desk.exr")?;
//! # Ok(())
//! # }
//! ```

mod filter;
mod filter_maker;
mod filter_pass;
mod lobe;
mod maps;
mod parallax;
mod pipeline;
mod refresh;
mod scene_probe;
mod scene_probe_pass;
mod source;

pub use maps::FilteredEnvironment;
pub use parallax::DeskParallax;
pub use refresh::{EnvironmentState, Refresh};
pub use scene_probe::{SceneCube, SceneProbe};

use crate::{
    MirrorballSystems,
    camera::ArCamera,
    device::{self, Needs},
    environment_map::{EnvironmentCube, LitByGame},
};
use bevy::{
    asset::LoadState,
    camera::{Exposure, RenderTarget},
    ecs::{observer::On, query::QueryFilter, system::SystemParam},
    light::EnvironmentMapLight,
    prelude::*,
};
use source::SourceShape;

/// Lights the view of a camera, or the surroundings of a [`LightProbe`], by a picture of the environment that changes while the
/// game runs.
///
/// An [`ArCamera`] gets one by itself as soon as a [`LightProbeSphere`](crate::probe::LightProbeSphere) exists. How far it is
/// says the [`EnvironmentState`] beside it. Taken from the entity, its lighting goes with it.
///
/// Units hold for the entity's own [`Exposure`]; a light probe without one follows that of the [`ArCamera`], else that of the active
/// `Camera3d` of the highest order.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_mirrorball::prefilter::{LiveEnvironment, Refresh};
///
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     let sky = assets.load("sky.hdr");
///     commands.spawn((Camera3d::default(), LiveEnvironment::new(sky).with_refresh(Refresh::OnChange)));
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Debug, Clone)]
#[require(EnvironmentState, LitByGame)]
pub struct LiveEnvironment {
    /// Linear radiance in frame buffer units (1.0 shows as 1.0), world axes. Either a cube (six square layers in Bevy's
    /// convention) or an equirectangular picture (twice as wide as high, column u/width is the azimuth from −Z towards +X,
    /// rows from +Y down), of any color format. Cubes with a power of two from 16 to 8192 as edge length are filtered as they
    /// are, all else is first resampled into a cube of at most 512. Changing the handle, and resizing the image, is fine.
    pub source: Handle<Image>,
    /// When the maps are made anew. Defaults to [`Refresh::EveryFrame`].
    pub refresh: Refresh,
}

impl LiveEnvironment {
    /// Lighting by `source`, refreshed every frame.
    pub fn new(source: Handle<Image>) -> Self {
        Self { source, refresh: Refresh::default() }
    }

    /// The same, refreshed as given.
    pub fn with_refresh(self, refresh: Refresh) -> Self {
        Self { refresh, ..self }
    }
}

/// Filters live environments.
pub struct PrefilterPlugin;

impl Plugin for PrefilterPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.register_type::<LiveEnvironment>()
            .register_type::<EnvironmentState>()
            .add_observer(take_light_away)
            .add_systems(
                PreUpdate,
                (light_cameras_by_probe, follow_sources, keep_intensity).chain().in_set(MirrorballSystems::Follow),
            )
            .register_type::<DeskParallax>()
            .add_systems(PostUpdate, request_refreshes.after(bevy::asset::AssetEventSystems))
            .add_systems(PostUpdate, parallax::follow_viewpoints.after(TransformSystems::Propagate));
        scene_probe::build(app);
    }

    fn finish(&self, app: &mut App) {
        let needs = Needs {
            plugin: "PrefilterPlugin",
            purpose: "environments will not be filtered",
            storage_buffers: 1,
            storage_textures: 2,
        };
        if device::can_draw(app, &needs) {
            filter_pass::build(app);
            scene_probe_pass::build(app);
        }
    }
}

type UnlitCamera = (With<ArCamera>, Without<LiveEnvironment>);

fn light_cameras_by_probe(mut commands: Commands, cameras: Query<Entity, UnlitCamera>, cubes: Query<&EnvironmentCube>) {
    let Some(cube) = cubes.iter().next() else {
        return;
    };
    for camera in &cameras {
        commands.entity(camera).insert(LiveEnvironment::new(cube.0.clone()).with_refresh(Refresh::OnChange));
    }
}

/// Intensity in cd/m² at which 1.0 in a map becomes 1.0 in the frame buffer.
fn unit_intensity(exposure: Option<&Exposure>) -> f32 {
    1.0 / exposure.copied().unwrap_or_default().exposure()
}

type Environment = (
    Entity,
    &'static LiveEnvironment,
    &'static mut EnvironmentState,
    Option<&'static FilteredEnvironment>,
    Option<&'static Exposure>,
    Option<(&'static DeskParallax, &'static GlobalTransform)>,
);

/// Gives maps to environments whose source has arrived, changed its size or been exchanged.
fn follow_sources(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    assets: Res<AssetServer>,
    mut environments: Query<Environment>,
    viewing: ViewingCamera<()>,
    existing: Query<&FilteredEnvironment>,
    mut new: Local<Vec<FilteredEnvironment>>,
) {
    for (entity, environment, mut state, maps, exposure, parallax) in &mut environments {
        let viewpoint = parallax.map(|(parallax, place)| parallax.viewpoint(place.translation()));
        let maps = maps.filter(|maps| {
            maps.source == environment.source
                && maps.refresh == environment.refresh
                && maps.viewpoint.is_some() == viewpoint.is_some()
        });
        let next = match images.get(&environment.source).map(SourceShape::of) {
            // Images that live on the GPU only may have left the assets.
            None if maps.is_some() => continue,
            None => match assets.get_load_state(&environment.source) {
                Some(LoadState::Failed(error)) => {
                    EnvironmentState::Refused(format!("LiveEnvironment.source cannot be loaded: {error}"))
                }
                _ => EnvironmentState::Waiting,
            },
            Some(Err(reason)) => EnvironmentState::Refused(reason),
            Some(Ok(shape)) if maps.is_some_and(|maps| maps.shape == shape) => continue,
            Some(Ok(shape)) => {
                let fits = |maps: &&FilteredEnvironment| {
                    let is_same = maps.source == environment.source && maps.shape == shape;
                    is_same && maps.refresh == environment.refresh && maps.viewpoint.is_none() && viewpoint.is_none()
                };
                let shared = existing.iter().chain(new.iter()).find(fits).cloned();
                let maps = shared.unwrap_or_else(|| {
                    let source = environment.source.clone();
                    let maps =
                        FilteredEnvironment::allocate(&mut images, source, shape, environment.refresh, viewpoint);
                    new.push(maps.clone());
                    maps
                });
                let light = EnvironmentMapLight {
                    diffuse_map: maps.diffuse.clone(),
                    specular_map: maps.glossy.clone(),
                    intensity: unit_intensity(Some(&exposure.copied().unwrap_or_else(|| viewing.exposure()))),
                    ..default()
                };
                commands.entity(entity).insert((maps, light));
                *state = EnvironmentState::Live { refreshes: 0, frames_since_refresh: 0 };
                continue;
            }
        };
        if *state != next {
            if let EnvironmentState::Refused(reason) = &next {
                error!("{entity}: {reason}");
            }
            *state = next;
            commands.entity(entity).remove::<(FilteredEnvironment, EnvironmentMapLight)>();
        }
    }
    new.clear();
}

fn take_light_away(removed: On<Remove, LiveEnvironment>, mut commands: Commands) {
    if let Ok(mut entity) = commands.get_entity(removed.entity) {
        entity.try_remove::<(FilteredEnvironment, EnvironmentMapLight, EnvironmentState)>();
    }
}

/// Says to the render world which maps are due, and to the game how old they are.
fn request_refreshes(
    mut environments: Query<(&FilteredEnvironment, &mut EnvironmentState)>,
    mut changes: MessageReader<AssetEvent<Image>>,
    cameras: Query<(&Camera, &RenderTarget)>,
) {
    for change in changes.read() {
        if let AssetEvent::Modified { id } = change {
            let changed = environments.iter().filter(|(maps, _)| maps.source.id() == *id);
            changed.filter(|(maps, _)| maps.refresh == Refresh::OnChange).for_each(|(maps, _)| maps.request_refresh());
        }
    }
    for (maps, mut state) in &mut environments {
        let is_rendered = |(camera, target): (&Camera, &RenderTarget)| {
            camera.is_active && target.as_image().is_some_and(|image| *image == maps.source)
        };
        let is_due = match maps.refresh {
            Refresh::EveryFrame | Refresh::Budget { .. } => true,
            Refresh::OnChange => cameras.iter().any(is_rendered),
            Refresh::OnRequest => false,
        };
        if is_due {
            maps.request_refresh();
        }
        if let EnvironmentState::Live { refreshes, frames_since_refresh } = state.as_mut() {
            let finished = maps.progress.finished();
            *frames_since_refresh = if finished == *refreshes { frames_since_refresh.saturating_add(1) } else { 0 };
            *refreshes = finished;
        }
    }
}

type LitEntity = (&'static mut EnvironmentMapLight, Option<&'static Exposure>);

fn keep_intensity(mut lights: Query<LitEntity, With<FilteredEnvironment>>, viewing: ViewingCamera<()>) {
    for (mut light, exposure) in &mut lights {
        let intensity = unit_intensity(Some(&exposure.copied().unwrap_or_else(|| viewing.exposure())));
        if light.intensity != intensity {
            light.intensity = intensity;
        }
    }
}

type View = (&'static Camera, Has<ArCamera>, Option<&'static Exposure>, Option<&'static AmbientLight>);

/// The camera that the player looks through: the first active [`ArCamera`], else the active [`Camera3d`] of the highest order.
/// What is no camera itself, such as a light probe, is exposed as it is.
#[derive(SystemParam)]
struct ViewingCamera<'w, 's, F: QueryFilter + 'static> {
    cameras: Query<'w, 's, View, (With<Camera3d>, F)>,
}

impl<F: QueryFilter> ViewingCamera<'_, '_, F> {
    fn view(&self) -> Option<(Option<Exposure>, Option<AmbientLight>)> {
        let active = self.cameras.iter().filter(|(camera, ..)| camera.is_active);
        // Cameras into pictures come before those into windows: the last is looked through.
        let view = active.max_by_key(|(camera, is_ar, ..)| (*is_ar, camera.order));
        view.map(|(_, _, exposure, ambient)| (exposure.copied(), ambient.cloned()))
    }

    fn exposure(&self) -> Exposure {
        self.view().and_then(|view| view.0).unwrap_or_default()
    }

    fn ambient(&self) -> Option<AmbientLight> {
        self.view().and_then(|view| view.1)
    }
}
