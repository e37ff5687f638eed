//! Materials: phantoms, and image-based, toon and classic surfaces.
//!
//! **Enters:** [`StageRole`](crate::phantom::StageRole) and [`SurfaceStyle`] of meshes, the textures of the shadow
//! dome, the camera frame. **Leaves:** materials that show phantoms as the camera frame under virtual shadows, and
//! extended `StandardMaterial`s whose image-based light is shadowed by the dome, shaded smoothly, in flat toon bands or
//! by a classic model.
//!
//! The `StandardMaterial` of a mesh is replaced by an [`ImageBasedMaterial`], a [`ToonMaterial`] or a
//! [`ClassicMaterial`] that extends it. Changes of the original asset are copied into the extended material.
//! [`SurfaceStyle::Engine`] keeps or restores the original. Styles may change at any time, at once or in a
//! [fade](StyleFade). [`MeasuredLightWeight`] says how much of the room's light surfaces receive beside that of the
//! author's lamps. The example `looks` has all parameters in a panel, and draws the styles side by side
//! (`assets/pictures/looks.webp`).
//!
//! # Virtual lamps on real surfaces
//! Bevy's point, spot and directional lights illuminate phantoms that receive shadows: camera frame × (visibility
//! ratio + `E_lamp` ÷ `E_real`). The frame already contains the surface color. `E_lamp` is the irradiance from the
//! lamps, shadowed by the virtual objects and phantoms in their shadow maps. `E_real` is the irradiance of the
//! environment map, shadowed by the phantoms in the dome. Both are in Bevy's units: a lamp of π lux doubles the
//! frame's brightness where the map, at an intensity of 1, is 1.0. Without an environment map on the camera there is
//! no `E_real`, and lamps illuminate virtual objects only.
//!
//! Scenes without lamps use pipelines without lamp code. Occlusion between phantoms is computed in the visibility
//! pass, as a single luminance. Lamps are treated as points; light textures and rectangle lights have no effect here.
//! Indirect light of lamps is left out, as it is on virtual surfaces.
//!
//! # Phantoms in several cameras
//! An [`ArCamera`](crate::camera::ArCamera) shows phantoms with its own frame: the part of it that its viewport and its
//! `sub_camera_view` show. In all other cameras (spectators, mirrors, [scene probes](crate::prefilter::SceneProbe))
//! phantoms do not exist, so that virtual objects are seen whole and nothing of the frame is seen, unless the camera
//! has [`ShowPhantoms`].
//!
//! # Neighbors in mirrors
//! Polished surfaces of [`SurfaceStyle::ImageBased`] (metals and other things that reflect a tenth of the light and
//! more, with a perceptual roughness below 0.6) mirror the virtual objects beside them, the real things and the shadows
//! on these, from where the mirror is and with parallax, in scenes with a
//! [`ShadowDomeLight`](crate::shadows::ShadowDomeLight). [`NeighborReflections`] has the number of mirrors, the budget
//! and the resolution; [`NoNeighborReflections`] excludes meshes. Six faces per mirror are rendered after a change, as
//! many per frame as the budget says, and none while nothing changes. Single-sided opaque meshes can be mirrors. Clear
//! coats and anisotropic metals mirror the room, and so do real mirrors. Other objects within the bounds of a mirror
//! reflect what that does. The method is that of Szirmay-Kalos, Aszódi, Lazányi and Premecz 2005, *Approximate
//! Ray-Tracing on the GPU with Distance Impostors*.
//!
//! # Edges of phantoms
//! A virtual object ends sharply, within one pixel, where a phantom hides it. [`SoftPhantomEdges`] on the camera
//! blends the two across the edge instead.
//!
//! # The camera's hand
//! Real cameras are noisy and a little blurred. With [`CameraGrain`] on the camera, virtual things are as much of both
//! as the frame is measured to be: noise by brightness, channel and spatial frequency, and edges as wide as those of
//! the marker. Cameras with a running webcam get it by themselves.
//!
//! # Together with other effects
//! What an [`ArCamera`](crate::camera::ArCamera) shows under the effects that games add. *Frame* means what the real
//! camera delivers; under all of them it stays as it is, except where the table says so. The tests are in
//! `tests/shadows/composition`. What cannot work is also said in the log, once.
//!
//! | on the camera or the scene | what to expect | test |
//! |---|---|---|
//! | `Hdr` | everything as without it | `film::a_high_dynamic_range…` |
//! | `Tonemapping` | without `Hdr`, virtual things are mapped and the frame is not; with `Hdr` Bevy maps both, and the log warns. `ArCamera` sets `Tonemapping::None` | `film::tone_mapping…` |
//! | `Bloom` | with a threshold of 1 and additive, what is brighter than white glows and the frame stays; `Bloom::NATURAL` scatters the frame too and keeps its brightness | `film::bloom…`, `film::natural_bloom…` |
//! | `DepthOfField` | no effect: Bevy computes it for its own perspective projection only; the log warns | `film::depth_of_field…` |
//! | `TemporalAntiAliasing` | smooths virtual things; each frame is shown as it is, never mixed with earlier ones, which would take its contrast and drag what moves. Virtual things are not smoothed where a phantom hides them | `time::temporal…` |
//! | `MotionBlur` | blurs virtual things; the frame has the blur of the real camera. Not together with `TemporalAntiAliasing`; the log warns | `time::motion_blur…` |
//! | `Fxaa`, `Smaa`, sharpening, color grading, auto exposure, vignette | change the finished picture, the frame in it too; `Msaa` changes virtual things only | `film::antialiasing…` |
//! | `DistanceFog` | lies before virtual things only | `film::fog…` |
//! | `ScreenSpaceAmbientOcclusion` | darkens creases of virtual things, also towards phantoms; needs one texture more than WebGPU guarantees | `order::ambient_occlusion…` |
//! | `DeferredPrepass`, `DefaultOpaqueRendererMethod::deferred` | surfaces of [`SurfaceStyle::Engine`] are drawn deferred, phantoms and the other styles always forward | `order::deferred…` |
//! | `AlphaMode::Blend` | the frame shows through, and shadows are summed in the fragment shader; casts like an opaque mesh, without `NotShadowCaster` | `order::the_photograph…` |
//! | `specular_transmission` | refracts the frame; casts like an opaque mesh, without `NotShadowCaster` | `order::the_photograph…` |
//! | `OrderIndependentTransparencySettings` | the same, sorted by depth; needs more storage buffers than the 8 that WebGPU guarantees | `order::transparency…` |
//! | `Camera::viewport` | the whole frame, fitted into the viewport | `view::a_viewport…` |
//! | `MainPassResolutionOverride` | the same with fewer pixels, for what scales them up | `view::a_main_pass…` |
//! | second window or target | a camera without frames shows virtual things; shadows are summed in the fragment shader | `view::a_second_target…` |
//! | `RenderLayers` | a mesh casts if it shares a layer with the [`ShadowDomeLight`](crate::shadows::ShadowDomeLight), seen or not | `parts::a_mesh_casts…` |
//! | `VisibilityRange` | levels of detail crossfade; out of range of all cameras, a mesh does not cast | `parts::levels…`, `parts::what_is_out…` |
//! | decals | forward decals paint on the frame and on virtual things, and cast nothing; clustered decals paint on virtual things only | `parts::a_decal…` |
//! | Draco, meshopt | Bevy 0.19.1 does not read them: loading ends with an error that names the extension. Export without compression | `parts::compressed…` |
//! | `Skybox`, `AtmosphereSettings` | cover the frame; the log warns | unit test of the warning |
//!
//! # Toon
//! The bands of a toon surface represent the measured light. Let E(n) be the light that a white matte surface facing
//! n would receive at this position (environment, lamps and ambient light together), l the direction of the key light,
//! N the surface normal, V the view, R the mirrored key light:
//!
//! | [`ToonModel`] | color |
//! |---|---|
//! | `RoomLight` | base color · mix(dark, E(l), level(position)) |
//! | `Phong` (Kunze 2006) | base color · diffuse · level(N·L) + specular · highlight((R·V)ⁿ), the highlight 0 where N·L ≤ 0 |
//!
//! - l is by default the direction from which light prevails. Irradiance at n minus irradiance at −n is exactly n ·
//!   (light vector) (Gershun 1936), so six lookups in the diffuse map and one sum over the lamps give it. [`ToonKey`]
//!   has the alternatives: the strongest real light or a direction of the author.
//! - position = (E(N) under all shadows − E(−l)) ÷ (E(l) − E(−l)), in luminance. Under a chosen key light it is N·L,
//!   times the fraction of this light that shadows leave: what a surface lacks of its light is attributed to it if it
//!   contributes 30 % or more.
//! - level: 0…1 in b bands of equal width, which are equally spaced in lightness. The highest has level 1, the lowest
//!   1/2b, the middle of its range, so that no shape becomes black. [`ToonRamps`] stand in for that.
//! - dark = E(−l), but at most 45 %, 20 %, 10 % and 0 % of E(l) with two, three, four and five bands, and the range
//!   E(l) − E(−l) counts as at least 30 % of E(l): in evenly lit rooms contrast is increased, as a draftsman would do.
//!   Neighboring bands differ by 8 and more in CIEDE2000 where the highest has a luminance of 0.18 and more, with four
//!   and five bands of 0.35.
//!
//! The lit side has the color of the light (and the brightness of white paper facing it), the dark side that of the
//! fill light, and a shadow lowers a surface by some bands. `Phong` takes direction and shadows from the room, neither
//! brightness nor color: without shadows it is Kunze's formula as it stands. Emissive light is added,
//! and [`ToonStyle::rim`] times E(N − V) where N·V < 0.3.
//!
//! Specular surfaces have a highlight: a spot in the color of the light where they would mirror l. It grows larger and
//! fainter with roughness, and is absent from the lowest band and where light comes equally from everywhere. Metals
//! have it in their own color, and 60 % of the brightness elsewhere. Base color, its texture, vertex colors, normal
//! map, alpha and emissive are kept; coats and transmission are not drawn. Band edges are one pixel wide, or soft
//! ([`ToonStyle::softness`]). Without any light a toon surface of the room's light is black.
//!
//! The outline is a child entity that draws the far side of the mesh, moved outwards by a number of pixels and meters.
//! Hard edges are closed by merging the normals at each position if the mesh's data is still on the CPU; otherwise the
//! line has gaps there. The line beside a right-angled edge is up to 30 % thinner. An outline has the depth of its
//! mesh, so it is hidden where the mesh touches something nearer to the camera, such as the desk it stands on. Alpha
//! masks cut holes into outlines as into surfaces; the holes have none of their own. Transparent surfaces have no
//! outline, and neither have meshes without normals.
//!
//! Cost: nine lookups in the diffuse map per pixel, one evaluation of the dome's shadows and, in scenes with lamps, two
//! loops over these, one of them with their shadow maps; two lookups and a loop more for a rim light. Outlines draw the
//! triangles of the mesh again. On software Vulkan a frame takes two thirds of the time of the engine's shading
//! under a static map and a dome (`benches/looks`).
//!
//! Limits: near a lamp the bands follow its falloff with distance and are not flat. All bands lie between two colors,
//! so with two lamps of different colors each side shows their mixture. Maps count as far away; light probes of the
//! engine other than the camera's map, irradiance volumes, light maps, rectangle lights and light textures have no
//! effect. Ramps have 256 steps at most.
//!
//! Sources: Kunze 2006, who takes ramps of two to five levels over N·L and R·V of one lamp from textures, draws
//! back faces in black lines, and switches the style per model.
//!
//! # Classic models
//! Classic surfaces are sums of lookups in the environment maps of the camera. Let D be the diffuse map at the normal
//! N (what white paper there shows), S the specular map where the view is mirrored, at the level of the roughness, a
//! the base color and α its alpha, l what white paper facing the strongest [`RealLight`](crate::lighting::RealLight)
//! shows of it, and H the direction halfway between that light and the view:
//!
//! | [`ClassicModel`] | color |
//! |---|---|
//! | `GlossMap` (Supan 2006) | a · mix(S, D, α) |
//! | `Combined` (Karlsson & Selegård 2005) | a · (ambient + diffuse · D) + specular · l · max(N·H, 0)ⁿ + reflection · S |
//! | `Mixed` | a · base · mix(1, D, diffuse) + mirror · S |
//! | `SphereMap` (Miller & Hoffman 1984) | a · diffuse · D + mirror · S, D and S from the ball in the frame |
//!
//! Emissive light is added. All light is in frame buffer units, so that D alone is as bright as a `StandardMaterial`
//! that reflects nothing. [`ClassicStyle`] has the options of S: a roughness of its own, refraction instead of
//! mirroring, Fresnel's factor F + (1 − F)(1 − N·V)⁵ (Schlick 1994), and S · max(0, 1 − threshold ÷ luminance of S),
//! which leaves lamps and windows. Lobes of cosⁿ in place of GGX are a choice of the environment:
//! [`SpecularLobe`](crate::prefilter::SpecularLobe). The highlight is absent where N·L ≤ 0. The maps contain that
//! light, too, so a mirror with a highlight shows it twice, as in the source.
//!
//! `SphereMap` needs no maps at all, for the weakest devices: seen from the camera, a mirror shows what the ball shows
//! at the same normal, and paper facing N what is diffusely around the direction that the ball mirrors at the normal
//! halfway between N and the view. The CPU cuts 32 × 32 texels out of each frame and sums them up for 16 × 16
//! directions, while a surface asks for it.
//!
//! Under a dome, D is multiplied with the ratio of the light that arrives, and S with the estimate for reflections. A
//! shadow takes the highlight first: what the surface lacks is attributed to the strongest light if that contributes
//! 30 % or more of D. Maps and lights count as far away. Textures, vertex colors, normal maps, occlusion, alpha and
//! emissive are kept; metalness, coats and transmission are not drawn. Virtual lamps, ambient light and light probes
//! of the engine have no effect, and neighbors are not mirrored.
//!
//! Cost: one lookup in each map, and under a dome one evaluation of its shadows. On software Vulkan a frame takes two
//! thirds of the time of the engine's shading under a static map and a dome (`benches/looks`).

mod alpha_mask;
mod classic;
mod dome_bindings;
mod grain;
mod image_based;
mod mesh_copy;
mod neighbors;
mod original_material;
mod outline;
mod phantom;
mod phantom_draw;
mod phantom_views;
mod planar;
mod screen_pass;
mod show_phantoms;
mod soft_edges;
mod strongest_light;
mod style;
mod surface_albedo;
mod toon;

pub use classic::{
    ClassicMaterial, ClassicShaded, exponent_from_perceptual_roughness, perceptual_roughness_from_exponent,
};
pub use grain::{CameraGrain, GrainMeasurement};
pub use image_based::{DomeShadowed, ImageBasedMaterial};
pub use neighbors::{NeighborReflections, NoNeighborReflections};
pub use outline::OutlineMaterial;
pub use phantom::PhantomMaterial;
pub use show_phantoms::ShowPhantoms;
pub use soft_edges::SoftPhantomEdges;
pub use style::{
    ClassicModel, ClassicStyle, CombinedModel, MeasuredLightWeight, MixedModel, PhongToon, SphereMapModel, StyleFade,
    SurfaceStyle, ToonKey, ToonModel, ToonStyle,
};
pub use toon::{ToonMaterial, ToonRamps, ToonShaded};

use crate::{
    MirrorballSystems,
    shadows::{DomeTextures, ShadowsPlugin},
};
use bevy::{asset::embedded_asset, prelude::*, shader::load_shader_library};
use style::{apply_styles, restore_originals, update_styled_materials};

/// Assigns the materials of this crate to meshes.
pub struct MaterialsPlugin;

impl Plugin for MaterialsPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::require_assets(app, "MaterialsPlugin");
        crate::schedule::configure(app);
        // The material shaders import the dome shaders, with or without a dome in the scene.
        if !app.is_plugin_added::<ShadowsPlugin>() {
            app.add_plugins(ShadowsPlugin);
        }
        load_shader_library!(app, "engine_features.wgsl");
        load_shader_library!(app, "lamps.wgsl");
        load_shader_library!(app, "phantom_frame.wgsl");
        load_shader_library!(app, "view_environment.wgsl");
        embedded_asset!(app, "phantom.wgsl");
        embedded_asset!(app, "phantom_prepass.wgsl");
        embedded_asset!(app, "image_based.wgsl");
        toon::build(app);
        classic::build(app);
        strongest_light::build(app);
        outline::build(app);
        soft_edges::build(app);
        grain::build(app);
        neighbors::build(app);
        planar::build(app);
        app.add_plugins((
            MaterialPlugin::<PhantomMaterial>::default(),
            MaterialPlugin::<ImageBasedMaterial>::default(),
        ))
        .init_resource::<phantom::PhantomMaterials>()
        .init_resource::<style::StyledMaterials<DomeShadowed>>()
        .init_resource::<style::StyledMaterials<ToonShaded>>()
        .init_resource::<style::StyledMaterials<ClassicShaded>>()
        .add_systems(
            PostUpdate,
            (
                (phantom::update_phantom_materials, phantom::assign_phantom_materials).chain(),
                toon::read_ramps,
                (style::advance_fades, style::start_fades).chain(),
                (update_styled_materials::<DomeShadowed>, update_styled_materials::<ToonShaded>),
                update_styled_materials::<ClassicShaded>,
                (restore_originals::<DomeShadowed>, restore_originals::<ToonShaded>),
                restore_originals::<ClassicShaded>,
                (apply_styles::<DomeShadowed>, apply_styles::<ToonShaded>, apply_styles::<ClassicShaded>),
                (outline::erase_outlines, outline::forget_changed_hulls),
                (outline::draw_outlines, alpha_mask::mark_alpha_masks, surface_albedo::mark_albedos),
            )
                .chain()
                // Without a renderer there are no materials to assign.
                .run_if(resource_exists::<DomeTextures>)
                .in_set(MirrorballSystems::Dress)
                .before(bevy::asset::AssetEventSystems),
        );
        phantom_views::build(app);
    }

    fn finish(&self, app: &mut App) {
        phantom_draw::finish(app);
        strongest_light::finish(app);
        neighbors::finish(app);
    }
}
