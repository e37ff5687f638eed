//! A dome of shadow directions colored by the measured environment.
//!
//! **Enters:** the meshes of the stage, the environment cube of a probe or, without one, the camera's `EnvironmentMapLight`,
//! [`RealLight`]s, a [`ShadowDomeLight`]. **Leaves:** [`DomeTextures`]: one depth atlas and two buffers from which materials
//! compute, per pixel and color channel, which share of the light arrives (`visibility.wgsl`), and a third with what the
//! visibility pass has computed for one camera.
//!
//! # How
//! Every direction is an orthographic view fitted to one sphere around all casters, a tile in one depth atlas. Casters are
//! drawn once per mesh, instanced over the directions: static, moving, skinned, morphed and alpha-masked meshes, both sides;
//! `NotShadowCaster` keeps one out. Each direction has two tiles: one sees virtual casters, one phantoms, because a real shadow
//! is in the picture already and must not be drawn again.
//!
//! With L(d) = environment radiance × solid angle in direction d, and `V_v`, `V_p` the visibility past virtual casters and
//! phantoms:
//! - a phantom shows `camera × Σ V_v·V_p·L·(n·d)₊ / Σ V_p·L·(n·d)₊`: each light takes away only its own color, what already
//!   lies in a real shadow is not darkened twice, and where nothing virtual is in the way the picture stays untouched;
//! - a virtual surface keeps `Σ V_v·[V_p·L + (1−V_p)·L_p]·(n·d)₊ / Σ L·(n·d)₊` of its diffuse image-based light: a phantom
//!   that hides a direction sends its own light `L_p` instead (the mean of the map below the horizon). Reflections stay as
//!   they are unless `occludes_reflections` is set.
//!
//! Directions below the horizon take part in the sums without shadow maps: what comes from there is the desk's light.
//!
//! The sums are taken in a compute pass at every pixel or every second one, where a depth and normal prepass says which surface
//! is there, and interpolated along surfaces ([`VisibilitySamples`]). By default each of 2 × 2 samples looks at every fourth
//! direction, in the order of their light, and has the sums of the others from its neighbors (interleaved sampling, Keller and
//! Heidrich 2001). Other cameras, transparent surfaces and edges too thin for a sample sum in the fragment.
//!
//! # Directions
//! They are spread evenly (a Fibonacci lattice), or a [`LightsFile`] says where directional and spot lights are
//! ([`DomeLights`]). Each stands for the part of the sphere that is nearest to it. A dome with one direction is a hand-placed light.
//!
//! The strongest real lights that are smaller than such a part are *key lights*: each has its own direction, a shadow map twice
//! as fine, a penumbra as wide as its angular radius makes it (PCSS), and the light of the map within a cone of 1¼ angular
//! radii and 1½ texels; the directions around have the rest. So all light is counted once, whatever is known of the lamps. One
//! whose position is known shines from there and falls off with the square of the distance. The environment cube keeps the
//! light of key lights for reflections.
//!
//! # Cost
//! One draw call per caster mesh whatever the number of directions. While nothing moves nothing is redrawn; while something
//! does, `refreshed_per_frame` shadow maps by light × age × movement, so that those which give 90 % of the light are never older
//! than eight frames ([`DomeState`] tells). Weights are summed when the environment is written. A sample takes one
//! lookup per direction and kind of casters, of a quarter of the directions if they are interleaved; a key light 12 per kind, where
//! it finds casters 20 more. The atlas has `2 · directions · resolution²` texels of four bytes, and four times as many for a key
//! light: 34 + 4 MB by default.
//!
//! # How true
//! Against 4096 rays under an even sky the root of the mean squared error is 0.010 with 64 directions and 0.006 with 256; under
//! real skies without key lights 0.01 to 0.1 with 64 (`tests/shadows/ray_truth.rs`); with a key light that gives two thirds of the
//! light 0.007, without 0.05. `benches/shadows.rs` compares with the engine's shadows.
//!
//! # Limits
//! One dome at a time, one camera with a visibility pass. Lines, points and meshes without triangles do not cast. The visibility
//! pass reads the first sample of a multisampled prepass, where that lies in its pixel. Beside Bevy's order-independent
//! transparency its buffers go beyond WebGPU's default of 8 in a fragment shader.
//!
//! Sources: Supan 2006 (row C8), whose dome subtracts blocked light with one map refreshed per frame; Fernando 2005 for PCSS (C3).

mod camera;
mod casters;
mod depth_pass;
mod dome;
mod extract;
mod filter;
mod key_lights;
mod lights_file;
mod schedule;
mod textures;
mod view;
mod visibility_pass;
mod weights_pass;

pub(crate) use casters::Cutout;
pub(crate) use filter::DomeShader;
pub use filter::ShadowFilter;
pub use lights_file::{DomeLights, FileLight, FileLightKind, LightsFile, LightsFileError};
pub(crate) use textures::DomeIdentity;
pub use textures::DomeTextures;

use crate::{
    MirrorballSystems,
    camera::ArCamera,
    device::{self, Needs},
    environment_map::EnvironmentCube,
    lighting::RealLight,
};
use bevy::{
    prelude::*,
    render::{
        RenderApp,
        extract_component::ExtractComponentPlugin,
        extract_resource::ExtractResourcePlugin,
        gpu_readback::{Readback, ReadbackComplete},
    },
    shader::{ShaderSettings, load_shader_library},
};
use casters::{Caster, Casters};
use dome::{BoundingSphere, Directions};
use key_lights::{KeyLight, KeySearch};
use schedule::Schedule;
use std::sync::Arc;
use textures::AtlasLayout;
use view::LightView;

/// A dome of shadow-casting directions colored by the measured environment; its up axis is the entity's +Y.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # use bevy_mirrorball::shadows::ShadowFilter;
/// # fn setup(mut commands: Commands) {
/// commands.spawn(ShadowDomeLight { directions: 128, filter: ShadowFilter::Gauss, ..default() });
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility, DomeState)]
pub struct ShadowDomeLight {
    /// Number of directions with shadow maps, 1…1024 (clamped), spread evenly over what `coverage` says. A single one
    /// points along the entity's +Y: the hand-placed light. Defaults to 64.
    pub directions: u32,
    /// Where the directions are. Defaults to the hemisphere above.
    pub coverage: DomeCoverage,
    /// How many of the strongest [`RealLight`]s have shadow maps of their own, twice as fine, with
    /// penumbras as wide as the light is, 0…8 (clamped). Their part of the environment's light is taken from the directions
    /// around them. Defaults to 2.
    pub key_lights: u32,
    /// Side of one direction's square shadow map in texels, 32…1024 (clamped; halved until the atlas fits the device's largest texture).
    /// Defaults to 256.
    pub resolution: u32,
    /// How shadow maps are read. Defaults to bilinear: where many directions meet, their sum is smooth.
    pub filter: ShadowFilter,
    /// Where visibility is computed. Defaults to every second pixel in both directions, interleaved.
    pub samples: VisibilitySamples,
    /// Directions whose shadow maps are drawn again in a frame in which casters move, 1 or more; raised where otherwise
    /// one of the directions that give 90 % of the light would wait for more than eight frames. Defaults to 16.
    pub refreshed_per_frame: u32,
    /// Share of the dome's light, 0…1, whose directions are taken as unobstructed without a look at their shadow maps: the
    /// dimmest ones. Defaults to 0.005.
    pub dim_share: f32,
    /// Whether shadows also darken what virtual surfaces mirror of the environment, estimated from the diffuse light that
    /// is missing. Defaults to `false`.
    pub occludes_reflections: bool,
}

impl Default for ShadowDomeLight {
    fn default() -> Self {
        Self {
            directions: 64,
            coverage: DomeCoverage::default(),
            key_lights: 2,
            resolution: 256,
            filter: ShadowFilter::default(),
            samples: VisibilitySamples::default(),
            refreshed_per_frame: 16,
            dim_share: 0.005,
            occludes_reflections: false,
        }
    }
}

impl ShadowDomeLight {
    /// Most directions a dome can have.
    pub const MAX_DIRECTIONS: u32 = 1024;

    /// Most key lights a dome can have.
    pub const MAX_KEY_LIGHTS: u32 = 8;

    /// The number of directions within its bounds.
    fn clamped_directions(&self) -> u32 {
        self.directions.clamp(1, Self::MAX_DIRECTIONS)
    }
}

/// Where a dome has shadow maps.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
pub enum DomeCoverage {
    /// Above the horizon; what comes from below is the light of the desk on which everything stands.
    #[default]
    Hemisphere,
    /// All around, for things that float or hang.
    Sphere,
}

/// Where the sum over all directions is computed.
///
/// All but the last need a depth and normal prepass, which is added to the camera they serve: the first active
/// [`ArCamera`], without one the first active `Camera3d`. Fragments that no sample belongs to (thin
/// things, transparent ones) and those of all other cameras compute it themselves.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
pub enum VisibilitySamples {
    /// As [`Half`](Self::Half); but each sample sums up a quarter of the directions (and all key lights) and has the rest from
    /// its neighbors on the same surface. Things thinner than six pixels are the less exact for it.
    #[default]
    Interleaved,
    /// At every second pixel in both directions, interpolated along surfaces.
    Half,
    /// At every pixel.
    Full,
    /// In every fragment that materials draw, without a prepass. Exact and slow.
    Fragment,
}

impl VisibilitySamples {
    /// Pixels across one sample; 0 without samples.
    fn pixels(self) -> u32 {
        match self {
            Self::Interleaved | Self::Half => 2,
            Self::Full => 1,
            Self::Fragment => 0,
        }
    }
}

/// What a [`ShadowDomeLight`] did in the last frame.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct DomeState {
    /// Number of meshes that cast.
    pub casters: u32,
    /// Directions whose shadow maps were drawn in this frame.
    pub redrawn: u32,
    /// Directions whose shadow maps show casters where they no longer are.
    pub outdated: u32,
    /// The fewest directions that together give 90 % of the light, as it was read back from the GPU some frames ago.
    pub main: u32,
    /// Real lights that have shadow maps of their own.
    pub key_lights: u32,
    /// Frames since casters were last where the oldest of the main directions' shadow maps shows them.
    pub oldest_main: u32,
}

/// Draws and weighs domes of shadow directions.
pub struct ShadowsPlugin;

impl Plugin for ShadowsPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        load_shader_library!(app, "dome.wgsl");
        load_shader_library!(app, "maps.wgsl");
        load_shader_library!(app, "visibility.wgsl");
        load_shader_library!(app, "receive.wgsl");
        app.register_type::<ShadowDomeLight>()
            .register_type::<DomeState>()
            .register_type::<DomeLights>()
            .init_asset::<LightsFile>()
            .init_asset_loader::<lights_file::LightsFileLoader>()
            .init_resource::<FittedDome>()
            .init_resource::<Refreshing>()
            .add_systems(
                PostUpdate,
                (
                    fit_dome,
                    (textures::fit_textures, camera::serve_camera).run_if(resource_exists::<DomeTextures>),
                    read_energies.run_if(resource_exists::<DomeTextures>),
                )
                    .chain()
                    .after(bevy::camera::visibility::VisibilitySystems::CheckVisibility)
                    .in_set(MirrorballSystems::Shade),
            );
        if app.get_sub_app(RenderApp).is_some() {
            app.add_plugins((
                ExtractResourcePlugin::<DomeTextures>::default(),
                ExtractComponentPlugin::<visibility_pass::ServedByDome>::default(),
            ));
        }
    }

    fn finish(&self, app: &mut App) {
        let is_mirrored = device::mirrors_samples(app);
        load_shader_library!(app, "samples.wgsl", move |settings: &mut ShaderSettings| {
            if is_mirrored {
                settings.shader_defs.push("MIRRORED_SAMPLES".into());
            }
        });
        let needs = Needs {
            plugin: "ShadowsPlugin",
            purpose: "there will be no dome shadows, phantoms or toons",
            storage_buffers: 6,
            storage_textures: 1,
        };
        if device::can_draw(app, &needs) {
            app.init_resource::<DomeTextures>();
            extract::build(app);
            depth_pass::build(app);
            weights_pass::build(app);
            visibility_pass::build(app);
        }
    }
}

/// What the render world has to know of the dome.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
struct FittedDome {
    /// None without a dome.
    directions: Directions,
    /// The views of the directions with shadow maps if a file tells them; empty where all their light is parallel.
    file_views: Arc<[LightView]>,
    /// The places for key lights, taken or not.
    keys: Vec<Option<KeyLight>>,
    world_from_dome: Quat,
    filter: ShadowFilter,
    samples: VisibilitySamples,
    dim_share: f32,
    occludes_reflections: bool,
    /// Whether the engine's lamps shine on phantoms.
    has_lamps: bool,
    sphere: Option<BoundingSphere>,
    casters: Vec<Caster>,
}

impl FittedDome {
    /// How many directions have shadow maps, besides key lights.
    fn direction_count(&self) -> u32 {
        self.directions.shadowed.len() as u32
    }

    /// Whether an atlas has a tile for every shadow map.
    fn fits(&self, layout: &AtlasLayout) -> bool {
        (layout.directions, layout.keys) == (self.direction_count(), self.keys.len() as u32)
    }

    /// The view of a direction with a shadow map, or of a key light; `None` on a free place.
    fn view(&self, index: u32) -> Option<LightView> {
        let index = index as usize;
        match index.checked_sub(self.directions.shadowed.len()) {
            Some(key) => self.keys.get(key).copied().flatten().map(|key| key.view),
            None => self.file_views.get(index).copied().or_else(|| {
                let direction = self.directions.shadowed.get(index)?;
                Some(LightView::parallel(self.world_from_dome * *direction, 0.0))
            }),
        }
    }

    /// Whether all shadow maps have to be drawn anew after another dome.
    fn differs_from(&self, old: &Self) -> bool {
        self.directions != old.directions
            || self.file_views != old.file_views
            || self.keys.len() != old.keys.len()
            || self.world_from_dome != old.world_from_dome
            || self.filter != old.filter
    }
}

/// Which shadow maps are drawn again.
#[derive(Resource, Default)]
struct Refreshing {
    schedule: Schedule,
    /// Directions to draw in this frame.
    chosen: Vec<u32>,
    /// Luminance × solid angle of each direction, read back from the GPU.
    energies: Vec<f32>,
    readback: Option<Entity>,
}

/// Bevy's lamps, whose light falls on real things too.
pub(crate) type Lamp = Or<(With<PointLight>, With<SpotLight>, With<DirectionalLight>)>;

type DomeItem =
    (&'static ShadowDomeLight, &'static GlobalTransform, &'static mut DomeState, Option<&'static DomeLights>);

fn fit_dome(
    mut fitted: ResMut<FittedDome>,
    mut refreshing: ResMut<Refreshing>,
    mut domes: Query<DomeItem>,
    mut casters: Casters,
    files: Res<Assets<LightsFile>>,
    lights: Query<&RealLight>,
    lamps: Query<(), Lamp>,
    probes: Query<&GlobalTransform, (With<EnvironmentCube>, Without<ArCamera>)>,
    mut spread: Local<Option<(DomeCoverage, u32, Directions)>>,
) {
    let refreshing = &mut *refreshing;
    let Some((dome, transform, mut state, file)) = domes.iter_mut().next() else {
        fitted.set_if_neq(FittedDome::default());
        *refreshing = Refreshing { readback: refreshing.readback, ..default() };
        return;
    };
    let casters = casters.gather();
    let spheres: Vec<_> = casters.iter().map(|caster| caster.sphere).collect();
    let sphere = BoundingSphere::around(&spheres).map(|sphere| sphere.or_keep(fitted.sphere));
    let (directions, file_views) = match file.and_then(|file| files.get(&file.0)) {
        Some(file) => {
            let found = file.views(dome.coverage, transform);
            (found.directions, found.views)
        }
        None => {
            let count = dome.clamped_directions();
            if spread.as_ref().is_none_or(|(coverage, old, _)| (*coverage, *old) != (dome.coverage, count)) {
                *spread = Some((dome.coverage, count, Directions::spread(dome.coverage, count)));
            }
            (spread.as_ref().map(|(.., directions)| directions.clone()).unwrap_or_default(), Arc::default())
        }
    };
    let search = KeySearch {
        places: dome.key_lights.min(ShadowDomeLight::MAX_KEY_LIGHTS),
        directions: directions.shadowed.len() as u32,
        coverage: dome.coverage,
        up: *transform.up(),
        measured_from: probes.iter().next().map(GlobalTransform::translation),
        casters: sphere,
        last: &fitted.keys,
    };
    let now = FittedDome {
        keys: search.choose(lights.iter()),
        directions,
        file_views,
        world_from_dome: transform.rotation(),
        filter: dome.filter,
        samples: dome.samples,
        dim_share: if dome.dim_share.is_finite() { dome.dim_share.clamp(0.0, 1.0) } else { 0.0 },
        occludes_reflections: dome.occludes_reflections,
        has_lamps: !lamps.is_empty(),
        sphere,
        casters,
    };
    let direction = |index: u32| now.view(index).map(|view| view.direction);
    let (first_key, all) = (now.direction_count(), now.direction_count() + now.keys.len() as u32);
    if now.differs_from(&fitted) {
        refreshing.schedule = Schedule::new((0..all).map(direction));
    } else {
        refreshing.schedule.advance(casters::movement(&fitted.casters, &now.casters));
        for index in (first_key..all).filter(|index| now.view(*index) != fitted.view(*index)) {
            refreshing.schedule.turn(index as usize, direction(index));
        }
    }
    let (chosen, ages) = refreshing.schedule.choose(dome.refreshed_per_frame.max(1), &refreshing.energies);
    state.set_if_neq(DomeState {
        casters: now.casters.len() as u32,
        redrawn: chosen.len() as u32,
        outdated: ages.outdated,
        main: ages.main,
        oldest_main: ages.oldest_main,
        key_lights: now.keys.iter().flatten().count() as u32,
    });
    refreshing.chosen = chosen;
    fitted.set_if_neq(now);
}

/// Asks for the light of the directions while there is something to choose between.
fn read_energies(
    mut commands: Commands,
    mut refreshing: ResMut<Refreshing>,
    textures: Res<DomeTextures>,
    fitted: Res<FittedDome>,
    mut asked: Local<u32>,
) {
    let shadow_maps = fitted.direction_count() + fitted.keys.len() as u32;
    let is_needed = shadow_maps > 1 && refreshing.schedule.is_outdated();
    if refreshing.readback.is_some() && (!is_needed || *asked != shadow_maps) {
        if let Some(mut readback) = refreshing.readback.take().and_then(|entity| commands.get_entity(entity).ok()) {
            readback.despawn();
        }
    } else if refreshing.readback.is_none() && is_needed {
        *asked = shadow_maps;
        let size = WEIGHT_BYTES as u64 * u64::from(shadow_maps);
        let readback = commands
            .spawn(Readback::buffer_range(textures.weights.clone(), 0, size))
            .observe(|answer: On<ReadbackComplete>, mut refreshing: ResMut<Refreshing>| {
                refreshing.energies = luminances(&answer.data);
            })
            .id();
        refreshing.readback = Some(readback);
    }
}

/// Bytes of `DomeWeight` in dome.wgsl.
const WEIGHT_BYTES: usize = 12;

/// Luminance of the light in a buffer of weights.
fn luminances(bytes: &[u8]) -> Vec<f32> {
    let luminance = |weight: &[u8]| {
        let half = |at: usize| half::f16::from_le_bytes([weight[at], weight[at + 1]]).to_f32();
        0.2126 * half(0) + 0.7152 * half(2) + 0.0722 * half(4)
    };
    bytes.chunks_exact(WEIGHT_BYTES).map(luminance).collect()
}
