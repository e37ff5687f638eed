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
//! real skies without key lights 0.01 to 0.1 with 64 (`tests/shadow_truth.rs`); with a key light that gives two thirds of the
//! light 0.007, without 0.05. `benches/shadows.rs` compares with the engine's shadows.
//!
//! # Limits
//! One dome at a time, one camera with a visibility pass. Lines, points and meshes without triangles do not cast. The visibility
//! pass reads the first sample of a multisampled prepass, where that lies in its pixel. Beside Bevy's order-independent
//! transparency its buffers go beyond WebGPU's default of 8 in a fragment shader.
//!
//! Sources: Supan 2006 (row C8), whose dome subtracts blocked light with one map refreshed per frame; Fernando 2005 for PCSS (C3).

mod atlas;
mod atlas_layout;
mod bounding_sphere;
mod casters;
mod directions;
mod dome_light;
mod filter;
mod fit;
mod fitted_dome;
mod key_lights;
mod lights_file;
mod refresh;
mod render;
mod view;
mod visibility_camera;

pub use atlas::DomeTextures;
pub use dome_light::{DomeCoverage, DomeState, ShadowDomeLight, VisibilitySamples};
pub use filter::ShadowFilter;
pub use lights_file::{DomeLights, FileLight, FileLightKind, LightsFile, LightsFileError};

pub(crate) use atlas::DomeIdentity;
pub(crate) use casters::AlphaMask;
pub(crate) use filter::DomeShader;
pub(crate) use fit::Lamp;

use crate::{
    MirrorballSystems,
    device::{self, Needs},
};
use bevy::{
    camera::visibility::VisibilitySystems,
    prelude::*,
    render::{RenderApp, extract_component::ExtractComponentPlugin, extract_resource::ExtractResourcePlugin},
};
use fitted_dome::{FittedDome, Refreshing};
use lights_file::LightsFileLoader;
use visibility_camera::VisibilityCamera;

/// Draws and weighs domes of shadow directions.
pub struct ShadowsPlugin;

impl Plugin for ShadowsPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        render::load_shaders(app);
        app.register_type::<ShadowDomeLight>()
            .register_type::<DomeState>()
            .register_type::<DomeLights>()
            .init_asset::<LightsFile>()
            .init_asset_loader::<LightsFileLoader>()
            .init_resource::<FittedDome>()
            .init_resource::<Refreshing>()
            .add_systems(
                PostUpdate,
                (
                    fit::fit_dome,
                    (atlas::fit_atlas, visibility_camera::choose_visibility_camera, fit::read_energies)
                        .chain()
                        .run_if(resource_exists::<DomeTextures>),
                )
                    .chain()
                    .after(VisibilitySystems::CheckVisibility)
                    .in_set(MirrorballSystems::Shade),
            );
        if app.get_sub_app(RenderApp).is_some() {
            app.add_plugins((
                ExtractResourcePlugin::<DomeTextures>::default(),
                ExtractComponentPlugin::<VisibilityCamera>::default(),
            ));
        }
    }

    fn finish(&self, app: &mut App) {
        render::load_sample_shaders(app);
        let needs = Needs {
            plugin: "ShadowsPlugin",
            purpose: "there will be no dome shadows, phantoms or toons",
            storage_buffers: 6,
            storage_textures: 1,
        };
        if device::can_draw(app, &needs) {
            app.init_resource::<DomeTextures>();
            render::build(app);
        }
    }
}
