//! Soft, colored shadows from a dome of directional shadow maps lit by the measured environment.
//!
//! **Enters:** the meshes of the scene, the environment cube of a probe (or the camera's `EnvironmentMapLight` if
//! there is no probe), [`RealLight`]s, and a [`ShadowDomeLight`]. **Leaves:** [`DomeTextures`]: one depth atlas and
//! two buffers from which materials compute the fraction of light that arrives, per pixel and color channel
//! (`render/visibility.wgsl`), and a third buffer with the results of the visibility pass for one camera.
//!
//! # Method
//! Each direction is an orthographic view, fitted to one sphere around all casters, and has a tile in the depth
//! atlas. Casters are drawn with one call per mesh, instanced over the directions: static, moving, skinned, morphed
//! and alpha-masked meshes, both sides of each face. `NotShadowCaster` excludes a mesh. Each direction has two tiles,
//! one for virtual casters and one for phantoms, because the camera's frame already contains the shadows of real
//! things, which must not be drawn again.
//!
//! Let L(d) be the environment's radiance × solid angle in direction d, and `V_v` and `V_p` the visibility past
//! virtual casters and past phantoms:
//! - A phantom shows `camera × Σ V_v·V_p·L·(n·d)₊ / Σ V_p·L·(n·d)₊`. Blocking a light removes only that light's
//!   color, real shadows are not darkened twice, and the frame stays unchanged where nothing virtual is in the way.
//! - A virtual surface keeps the fraction `Σ V_v·V_p·L·(n·d)₊ / Σ L·(n·d)₊` of its diffuse image-based light.
//!   Reflections are unchanged unless `occludes_reflections` is set.
//!
//! Directions below the horizon take part in the sums but have no shadow maps: their light comes from the desk.
//!
//! # Bounced light
//! What hides a direction sends light of its own. The surfaces of casters are divided into *surfels*, small discs,
//! more of them on larger casters. A surfel has the radiance `B` = albedo × E ÷ π. E is the light that arrives at it:
//! that of the dome, then, once, that of the other surfels. Albedos are base colors (in the mean over the texture); a
//! metal counts as matte. Of a real surface, `B` is what the frame shows × the fraction of its light that virtual
//! things leave. Where the frame does not show it, its albedo is that of what the frame shows of the same phantom.
//! With `F`, the projected solid angle of a disc:
//! - The sum of a virtual surface also has `Σ (B − L_d)·F`. Below the horizon, where there are no shadow maps, a surfel
//!   hides `L_d`, the mean of the map there; above, `L_d` is 0.
//! - A phantom shows `camera × (Σ V_v·V_p·L·(n·d)₊ + Σ B·F) / (Σ V_p·L·(n·d)₊ + Σ B_r·F)`, where `B_r` is `B` without
//!   virtual things (0 for virtual surfels). No albedo of the receiver is needed.
//!
//! Nothing between a surfel and its receiver is taken into account, and virtual things are as bright beneath as if no
//! shadow lay on the desk. With `surfels` set to 0, virtual things send no
//! light, and a phantom that hides a direction from a virtual surface sends `L_d`; so does one that the limit leaves
//! out.
//!
//! A compute pass sums at every pixel or at every second one, reads the surface from a depth and normal prepass, and
//! materials interpolate its samples along surfaces ([`VisibilitySamples`]). By default, each of 2 × 2 samples sums
//! over every fourth direction, ordered by strength, and takes the sums over the other directions from its neighbors
//! (interleaved sampling, Keller and Heidrich 2001). What a sample has looked up is kept while it shows the same point
//! and nothing is drawn into the shadow map: where nothing moves, light may change without a single lookup. Fragments
//! too thin for a sample take those of the nearest similar surfaces. Other cameras and transparent surfaces sum in the
//! fragment shader.
//!
//! # Directions
//! Directions are spread evenly (a Fibonacci lattice), or a [`LightsFile`] lists directional lights and spot lights
//! ([`DomeLights`]). Each direction stands for its cell: the part of the sphere that is nearest to it. A dome with a
//! single direction is a light placed by hand.
//!
//! The strongest real lights that are smaller than a cell are *key lights*. Each has its own direction, a shadow map
//! with twice the resolution, a penumbra as wide as its angular radius requires (PCSS), and the light of the map
//! within a cone of 1¼ angular radii plus 1½ texels. The directions around it keep the rest. So all light is counted
//! exactly once, however much is known about the lamps. A key light with a known position shines from there and falls
//! off with the square of the distance. The environment cube keeps the light of key lights, for reflections.
//!
//! A search for blockers that takes samples misses a pole between them, and its shadow comes out in dashes. So the maps
//! of key lights have *depth pyramids*: the depth nearest to the light in blocks of several sizes. The search looks at
//! all blocks that the widest possible penumbra touches, narrows that to what the nearest depth in them allows, and
//! repeats this. It misses nothing, and ends early where nothing is in the way.
//!
//! # Cost
//! One draw call per caster mesh, whatever the number of directions. Nothing is redrawn while nothing moves. While
//! casters move, `refreshed_per_frame` shadow maps are redrawn per frame, chosen by light × age × movement, so that the
//! directions that give 90 % of the light are never older than eight frames ([`DomeState`] reports this, and
//! milliseconds). Weights are summed when the environment is written.
//!
//! A sample that shows another point than before takes one lookup per direction and kind of caster that is there, or a
//! quarter of that if samples are interleaved; the others take those of the maps that were redrawn. A key light reads 4
//! to 64 blocks of a pyramid per kind, and takes 32 lookups where they hold casters. A moving camera changes all
//! samples. Where the light changes, each sample sums over its directions again; where nothing changes, it is only
//! compared. Lookups take two bytes per sample and direction (half a byte if interleaved: 2 MB at 640 × 360) and are
//! not kept beyond 128 MB. The atlas has `2 · directions · resolution²` texels of four bytes, and four times as many
//! per key light: 34 + 4 MB by default.
//!
//! Milliseconds of passes on the GPU, in the benchmark's scene (20 casters of 20 000 triangles, 640 × 360, 64
//! directions, llvmpipe of Mesa 22.3 on two cores, 2026-11-29; `cargo bench --profile dev --features egui,webcam
//! --bench shadows -- --directions 64 --samples interleaved --triangles 20000 --cases static,lights,moving,camera
//! --real-lights 2 --passes`). Both places for key lights are taken. The main pass takes 51 to 67 without a dome and 86
//! to 109 with two of Bevy's shadow-casting directional lights.
//!
//! | | nothing changes | lights do | casters turn | camera moves |
//! |---|---|---|---|---|
//! | shadow maps | – | 7 to 10 | 40 to 66 | – |
//! | depth pyramids | – | 3 to 4 | 3 to 8 | – |
//! | weights | – | 1 | – | – |
//! | prepass | 2 to 3 | 4 to 5 | 4 | 2 to 3 |
//! | visibility | 3 | 40 to 55 (16 without key lights) | 52 | 61 to 75 |
//! | main pass beyond that without a dome | 11 to 13 | 14 to 16 | 17 to 22 | 5 to 19 |
//! | lookups per sample in the visibility pass | 0 | 2 key lights | 4 and key lights | 16 and key lights |
//!
//! On `SwiftShader`, without key lights, the main pass takes 211 without a dome and 254 with it, visibility 13, 72, 108
//! and 146, and the prepass 6 to 9.
//!
//! Bounced light: a sample reads all surfels when it is summed, or a quarter of them if samples are interleaved, 48
//! bytes each. Surfels are lit again when casters, the environment or the camera's frame change; each takes a lookup
//! per direction and reads all others.
//!
//! Per pixel, the main pass reads four samples of 32 bytes; a sample sums over 32 directions of 16 bytes, half of them
//! below the horizon, and compares nine neighbors.
//!
//! # Accuracy
//! Compared with 4096 rays under a uniform sky, the root mean square error is 0.010 with 64 directions and 0.006 with
//! 256. Under real skies without key lights it is 0.01 to 0.1 with 64 directions (`tests/shadows/ray_truth`). With a
//! key light that gives two thirds of the light it is 0.007, without that key light 0.05. `benches/shadows`
//! compares with Bevy's shadows.
//!
//! # Limits
//! One dome at a time, and one camera with a visibility pass. Meshes whose data is not on the CPU
//! (`RenderAssetUsages::RENDER_WORLD`) cast, but have no surfels. Lines, points and meshes without triangles do not
//! cast. The visibility pass reads the first sample of a multisampled prepass, at the position of that sample within
//! its pixel. Together with Bevy's order-independent transparency, the buffers exceed WebGPU's default of 8 in a
//! fragment shader.
//!
//! Sources: Bunnell 2005 (*GPU Gems 2*, chapter 14) for light between discs, after the instant radiosity of Keller
//! 1997 and the reflective shadow maps of Dachsbacher and Stamminger 2005; Supan 2006, whose dome subtracts blocked
//! light and refreshes one map per frame; Fernando 2005 for percentage-closer soft shadows (PCSS); Keller and Heidrich
//! 2001 for interleaved sampling; Greene, Kass and Miller 1993 for pyramids of depths.
//!
//! [`RealLight`]: crate::lighting::RealLight

mod atlas;
mod atlas_layout;
mod bounce;
mod bounding_sphere;
mod casters;
mod directions;
mod dome_light;
mod dome_rays;
mod filter;
mod fit;
mod fitted_dome;
mod key_lights;
mod lights_file;
mod pass_times;
mod planar;
mod refresh;
mod render;
mod view;
mod visibility_camera;

pub use atlas::DomeTextures;
pub use dome_light::{DomeCoverage, DomeState, ShadowDomeLight, VisibilitySamples};
pub use filter::ShadowFilter;
pub use lights_file::{DomeLights, DomeLightsTemplate, FileLight, FileLightKind, LightsFile, LightsFileError};
pub use pass_times::DomeTimes;
pub use planar::{
    PlanarCasters, PlanarLight, PlanarLightPlace, PlanarLights, PlanarShadow, PlanarShadowState, PlanarStandIn,
    planar_projection,
};

pub(crate) use atlas::DomeIdentity;
pub(crate) use bounce::SurfaceAlbedo;
pub(crate) use casters::AlphaMask;
pub(crate) use dome_rays::{DomeRay, DomeRays};
pub(crate) use filter::DomeShader;
pub(crate) use fit::Lamp;
pub(crate) use planar::PlanarTexture;

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

/// Draws the shadow maps of a [`ShadowDomeLight`] and sums the light that arrives at surfaces.
pub struct ShadowsPlugin;

impl Plugin for ShadowsPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::require_assets(app, "ShadowsPlugin");
        crate::schedule::configure(app);
        render::load_shaders(app);
        app.init_asset::<LightsFile>()
            .init_asset_loader::<LightsFileLoader>()
            .init_resource::<FittedDome>()
            .init_resource::<Refreshing>()
            .init_resource::<bounce::Surfels>()
            .init_resource::<planar::PlanarPlans>()
            .add_systems(
                PostUpdate,
                (
                    (fit::fit_dome, bounce::collect_surfels, pass_times::report_pass_times).chain(),
                    planar::plan_shadows.run_if(resource_exists::<DomeTextures>),
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
            storage_buffers: 7,
            storage_textures: 0,
        };
        if device::can_draw(app, &needs) {
            app.init_resource::<DomeTextures>();
            render::build(app);
            planar::build(app);
        }
    }
}
