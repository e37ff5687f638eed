//! Live, measured light from the real world for Bevy.
//!
//! A camera sees a printed marker and a mirrored ball. The marker gives the camera's pose, the image of the ball
//! becomes an environment map, and virtual objects are lit by it, mirror it, and cast soft colored shadows on each
//! other and on the real things in the frame.
//!
//! ```no_run
//! use bevy::prelude::*;
//! use bevy_mirrorball::prelude::*;
//!
//! App::new()
//!     .add_plugins((DefaultPlugins, MirrorballPlugins))
//!     .add_systems(Startup, |mut commands: Commands, assets: Res<AssetServer>| {
//!         // A scene authored with glTF extras: marker, ball, phantoms and dome are all in it.
//!         commands.spawn(WorldAssetRoot(assets.load(GltfAssetLabel::Scene(0).from_asset("desk/desk.glb"))));
//!         commands.spawn((
//!             ArCamera::new(Intrinsics::from_horizontal_fov(UVec2::new(640, 480), 0.98)),
//!             CameraFeed::file("assets/desk/photo.jpg"),
//!         ));
//!     })
//!     .run();
//! ```
//!
//! # Data flow
//!
//! ```text
//!  frame ────► camera ──┬─► tracking ──► camera pose / anchor transforms
//!                       │        │                        │
//!                       │        │ radiance of the paper  │ position of the ball
//!                       │        ▼                        ▼
//!                       ├─ phantom ───► probe ── where the ball is, what is around it
//!  glTF ──► authoring ──┤  (real or      │
//!                       │   virtual)     ▼
//!                       ├──────────► lighting ── what the camera clipped, from the desk ──► real lights as entities
//!                       │                │ gain per direction
//!                       │                ▼
//!                       ├──────────► unwrap ── cube ──► prefilter ── diffuse + specular maps ──► StandardMaterial
//!                       │                                │
//!                       │     casters, real lights ──► shadows ── depth atlas + weight per direction
//!                       │                                │
//!                       └─ background                    ▼
//!                             └──────────► materials ── phantoms: frame × ratio; virtual: diffuse × ratio, or bands
//! ```
//!
//! The modules are the stages in this order, and so are the sets of a frame, [`MirrorballSystems`] and
//! [`MirrorballPasses`]. Each module's documentation states what enters, what leaves, what it costs and where its
//! limits are. A stage uses only the stages above it, and all stages use the ground floor: [`environment_map`] and
//! [`headless`].
//! [`mod@debug`] reads the results of all stages and shows how well the measurement works.
//!
//! # Passes
//! What used to be nodes of a render graph are systems in Bevy 0.19, and the passes of this crate are such systems:
//!
//! | schedule of the render world | set or place | passes |
//! |---|---|---|
//! | `RenderGraph`, once a frame | [`MirrorballPasses::WriteCubes`] | balls and probe cameras → environment cubes ([`unwrap`]) |
//! | | [`MirrorballPasses::ReadCubes`] | filtered maps ([`prefilter`]), weights of the dome ([`shadows`]), mirrors ([`materials`]) |
//! | | before all cameras | shadow maps of the dome ([`shadows`]) |
//! | | after all cameras | faces of scene probes ([`prefilter`]), images of maps ([`mod@debug`]) |
//! | `Core3d`, per camera | after the prepass | motion of the background ([`camera`]), dome visibility ([`shadows`]) |
//! | | in the main pass | the frame as background ([`camera`]); phantoms and styles draw with Bevy's meshes |
//! | | post-processing | soft edges of phantoms, early, and grain, after tone mapping ([`materials`]) |
//!
//! # Events and conditions
//!
//! Each state has a component to read and, where games react to its changes, an event for
//! [observers](bevy::ecs::observer) on the entity or on all: [`MarkerFound`](tracking::MarkerFound) and
//! [`MarkerLost`](tracking::MarkerLost), [`FeedLost`](camera::FeedLost) and [`FeedRecovered`](camera::FeedRecovered),
//! [`EnvironmentMeasured`](probe::EnvironmentMeasured), [`RealLightAppeared`](lighting::RealLightAppeared) and
//! [`RealLightVanished`](lighting::RealLightVanished). Conditions for systems are
//! [`any_marker_tracked`](tracking::any_marker_tracked), [`world_origin_tracked`](tracking::world_origin_tracked),
//! [`any_feed_lost`](camera::any_feed_lost) and [`is_lit_by_measurement`](probe::is_lit_by_measurement).
//!
//! # Scenes in code
//!
//! All components have defaults or templates, so scenes can be written with Bevy's `bsn!`:
//!
//! ```
//! use bevy::prelude::*;
//! use bevy_mirrorball::prelude::*;
//!
//! fn desk() -> impl Scene {
//!     bsn! {
//!         MarkerAnchor { size: 0.12 }
//!         WorldOrigin
//!         on(|_: On<MarkerLost>| info!("show the camera the marker"))
//!         Children [
//!             (LightProbeSphere { radius: 0.04 } Transform::from_xyz(0.17, 0.04, 0.01)),
//!             (PhantomObject { casts: false }),
//!             (SurfaceStyle::Toon(ToonStyle { bands: 2 })),
//!         ]
//!     }
//! }
//!
//! fn setup(mut commands: Commands) {
//!     commands.spawn_scene(desk());
//!     commands.spawn_scene(bsn! { ArCamera CameraFeed::clip("assets/desk_clip") });
//!     commands.spawn_scene(bsn! { ShadowDomeLight { directions: 32 } });
//! }
//! # bevy::ecs::system::assert_is_system(setup);
//! ```
//!
//! # Glossary
//!
//! - *frame*: one image that a camera delivers ([`CameraFrame`](camera::CameraFrame)); *image* means a file or a
//!   texture.
//! - *intrinsics*: focal lengths and principal point of a camera in pixels, and the distortion of its lens
//!   ([`Intrinsics`](camera::Intrinsics)); *calibration* measures them ([`camera::calibration`]).
//! - *marker*: printed square of an AprilTag family; its frame of reference is a
//!   [`MarkerAnchor`](tracking::MarkerAnchor).
//! - *phantom*: virtual stand-in for a real thing: it hides virtual things and catches their shadows
//!   ([`PhantomObject`](phantom::PhantomObject)).
//! - *light probe*: a mirrored ball, a fisheye or another device whose frames show the surroundings ([`probe`]).
//! - *radiance*: light from one direction, per channel, in linear camera units; *irradiance* is its cosine-weighted
//!   integral.
//! - *clipped*: at the sensor's white: the true radiance is larger by an unknown *gain*, which [`lighting`] recovers.
//! - *exposure bracketing*: frames of one scene with several exposures; short ones show what the normal one clips
//!   ([`BracketedFrames`](camera::BracketedFrames)).
//! - *light transport*: irradiance at points of the desk per radiance of each direction, past everything in between
//!   ([`lighting::solver`]).
//! - *environment cube*: cube map with the radiance of all directions around the probe; alpha is confidence
//!   ([`EnvironmentCube`](environment_map::EnvironmentCube)).
//! - *temporal history*: what earlier frames showed of directions that the present one does not ([`unwrap`]).
//! - *prefiltering*: convolution of the cube for diffuse and specular reflection, one mip level per roughness
//!   ([`prefilter`]).
//! - *dome*: the set of shadow directions that samples the whole environment
//!   ([`ShadowDomeLight`](shadows::ShadowDomeLight)).
//! - *key light*: a strong, compact real light with a finer shadow map of its own ([`RealLight`](lighting::RealLight)).
//! - *visibility pass*: compute pass that sums visibility × light once per sample of the frame instead of once per
//!   fragment.
//! - *twin*: function on the CPU and the same one in a shader; a *mirror* is a struct that both share byte for byte.
//!
//! # Cargo features
//! - `apriltag` (default): marker detection with the AprilTag C library; needs a C compiler.
//! - `webcam`: `CameraFeed::device`; on Linux building needs libclang.
//! - `egui`: `debug::MirrorballPanelPlugin`. `audio`, `gamepad`: for the example `dance_stage` only.
//! - `locus`: marker detection in pure Rust, for tag36h11. `webgpu`: Bevy's renderer for browsers; `docs/WEB.md` says
//!   what a game there has to bring, and what is different.
//!
//! # Frames of reference and units
//! World: Bevy's, right-handed, +Y up, meters. Marker: origin at the center of the black square, +X right, +Y out of
//! the paper, +Z to the bottom edge of the marker as the AprilTag project prints it; flat on a desk it has +Y up.
//! Camera: Bevy's, looks along −Z. Frames and images: pixels, origin top-left, +v down, the first pixel's center at
//! 0.5. Transforms are named `target_from_source`. Angles are radians unless a name says degrees.
//!
//! Light is in *linear camera units*: 1.0 is the sensor's white, and shows as 1.0 in the frame buffer at any
//! [`Exposure`](bevy::camera::Exposure). A white virtual surface beside white paper comes out as white as the paper.
//!
//! # Drivers
//! The output must not depend on what WGSL leaves open: the accuracy of `atan2`, `sin` and the like, filtering weights,
//! lookups across the edges of a cube, derivatives, not-a-number, the order of writes. Therefore angles come from
//! `trigonometry.wgsl`, tables and solid angles from the CPU in double precision, cubes are read face by face
//! (`environment_map/cubemap.wgsl`), multisampled prepasses are read where their samples lie, and divisors are clamped.
//! `tests/environment/shaders` lists each use of a loosely defined builtin with the reason why it is harmless.
//!
//! Each shader stage keeps within WebGPU's default limits, in addition to what Bevy binds for the view, the mesh and a
//! `StandardMaterial`:
//!
//! | in a fragment of an [`ArCamera`](camera::ArCamera) | WebGPU | image-based, toon or classic surface | of it ours |
//! |---|---|---|---|
//! | sampled textures | 16 | 16 | 1 |
//! | samplers | 16 | 13 | 1 |
//! | storage buffers | 8 | 8 | 4 |
//! | uniform buffers | 12 | 6 | 1 |
//!
//! No texture and no storage buffer is left: the next feature has to share a binding. `tests/environment/device.rs`
//! counts. Bevy itself exceeds these limits on native devices (occlusion culling, its own environment filter) and omits
//! those features where they do not fit; its ambient occlusion needs one texture more than there is. On WebGPU
//! irradiance volumes are off, so they need none.
//!
//! # When the graphics device is lost
//! A driver that is reset or updated, or a GPU that is unplugged, takes all textures with it. Bevy then ends the game
//! with [`AppExit::error`](bevy::app::AppExit) and says so in the log; [`headless::update`] returns
//! [`HeadlessError::Stopped`](headless::HeadlessError::Stopped). Nothing hangs. A game that goes on all the same has no
//! pictures. `RenderErrorPolicy::Recover` does not work with Bevy 0.19.1, which aborts in its own startup: save what
//! matters, and start the program again.
//!
//! # Why does nothing happen?
//! The [`Checklist`](debug::Checklist) answers in words while the game runs, and the panel of the feature `egui` shows
//! it.
//!
//! - *The camera's frames are not shown:* read the [`FeedState`](camera::FeedState) on the camera; a source that cannot
//!   be read is an error in the log.
//! - *The camera does not move:* [`MarkerTracking::state`](tracking::MarkerTracking::state) stays `Searching` until the
//!   whole marker is in the frame, 40 pixels wide, sharp and with its white margin. One anchor needs
//!   [`WorldOrigin`](tracking::WorldOrigin). Mirrored frames, as in previews of front cameras, have no readable marker:
//!   [`DetectedMarkers::mirrored`](tracking::DetectedMarkers::mirrored).
//! - *Objects are misplaced:* without [`ArCamera::intrinsics`](camera::ArCamera::intrinsics) a field of view of 60° is
//!   assumed; [`calibration`](camera::calibration) measures the lens.
//! - *Objects are black:* [`ProbeMeasurement::is_in_view`](probe::ProbeMeasurement::is_in_view) says whether the ball
//!   is where the scene says, at least 12 pixels wide.
//! - *No shadows:* a [`ShadowDomeLight`](shadows::ShadowDomeLight) has to exist, the desk has to be a
//!   [`PhantomObject`](phantom::PhantomObject), and casters must not have `NotShadowCaster`.
//! - *Lights are colored oddly or too strong:* lower the camera's exposure until few pixels of the ball are clipped
//!   ([`ProbeMeasurement::clipped_fraction`](probe::ProbeMeasurement::clipped_fraction)), or add
//!   [bracketed exposures](camera::BracketedFrames).

// The ground floor, then the stages in the order of the data flow.
pub mod environment_map;
#[cfg(not(target_arch = "wasm32"))]
pub mod headless;

pub mod camera;
pub mod tracking;
pub mod phantom;
pub mod probe;
pub mod lighting;
pub mod unwrap;
pub mod prefilter;
pub mod shadows;
pub mod materials;
pub mod authoring;
pub mod debug;
pub mod prelude;
mod compute_pass;
mod device;
mod frame_tasks;
mod image_files;
mod least_squares;
mod luminance;
mod median;
mod panic_text;
mod relative_paths;
mod schedule;
mod trigonometry;
mod unpad_rows;

/// Old name of [`prefilter`] and [`environment_map`].
#[deprecated(since = "0.1.0", note = "use `prefilter` for what lights, `environment_map` for maps themselves")]
#[doc(hidden)]
pub mod environment {
    pub use crate::prefilter::PrefilterPlugin as EnvironmentPlugin;
    pub use crate::{environment_map::*, prefilter::*};
}

/// Old name of [`phantom`].
#[deprecated(since = "0.1.0", note = "use `phantom`")]
#[doc(hidden)]
pub mod stage {
    pub use crate::phantom::{PhantomPlugin as StagePlugin, *};
}

/// Old name of [`headless`].
#[cfg(not(target_arch = "wasm32"))]
#[deprecated(since = "0.1.0", note = "use `headless`")]
#[doc(hidden)]
pub mod offscreen {
    pub use crate::headless::{HeadlessError as OffscreenError, *};
}

use bevy::{app::PluginGroupBuilder, prelude::*};

/// All plugins of the crate. Add it after [`DefaultPlugins`]; in the other order the app panics when it is built, with
/// a message that says so.
///
/// | plugin | responsibility |
/// |---|---|
/// | [`camera::CameraPlugin`] | receives camera frames, shows them, projects like the real camera |
/// | [`tracking::TrackingPlugin`] | detects markers, moves the camera or the anchors |
/// | [`phantom::PhantomPlugin`] | separates real from virtual things |
/// | [`probe::ProbePlugin`] | measures where the light probes are and what surrounds them |
/// | [`lighting::LightingPlugin`] | recovers clipped light, detects and tracks real lights |
/// | [`unwrap::UnwrapPlugin`] | frames → environment cube |
/// | [`prefilter::PrefilterPlugin`] | environment cube → light on every `StandardMaterial` |
/// | [`shadows::ShadowsPlugin`] | dome of shadow directions |
/// | [`materials::MaterialsPlugin`] | phantoms, image-based, toon and classic surfaces |
/// | [`authoring::AuthoringPlugin`] | glTF extras → components |
/// | [`debug::MirrorballDiagnosticsPlugin`] | measurements as Bevy diagnostics |
/// | [`debug::MapViewPlugin`] | images of the environment's maps |
/// | [`debug::MirrorballGizmosPlugin`] | markers, balls, lights, dome and phantoms as lines; off by default |
///
/// Each can be used alone or left out with [`PluginGroupBuilder::disable`].
#[derive(Default)]
pub struct MirrorballPlugins;

impl PluginGroup for MirrorballPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(camera::CameraPlugin)
            .add(tracking::TrackingPlugin)
            .add(phantom::PhantomPlugin)
            .add(probe::ProbePlugin)
            .add(lighting::LightingPlugin)
            .add(unwrap::UnwrapPlugin)
            .add(prefilter::PrefilterPlugin)
            .add(shadows::ShadowsPlugin)
            .add(materials::MaterialsPlugin)
            .add(authoring::AuthoringPlugin)
            .add(debug::MirrorballDiagnosticsPlugin)
            .add(debug::MapViewPlugin)
            .add(debug::MirrorballGizmosPlugin)
    }
}

pub use schedule::{MirrorballPasses, MirrorballSystems};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeCodeCompiles;
