//! Live, measured light from the real world for Bevy.
//!
//! A camera sees a printed marker and a mirrored ball. The marker tells where the camera is, the picture of the ball becomes an
//! environment map, and virtual objects are lit by it, mirror it, and cast soft colored shadows on each other and on the real
//! things in the picture.
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
//!  picture ──► camera ──┬─► tracking ──► camera pose / anchor transforms
//!                       │        │                        │
//!                       │        │ paper brightness       │ place of the ball
//!                       │        ▼                        ▼
//!                       ├─ phantom ───► probe ── where the ball is, what is around it
//!  glTF ──► authoring ──┤  (real or      │
//!                       │   virtual)     ▼
//!                       ├──────────► lighting ── what the camera clipped, from the desk ──► real lights as entities
//!                       │                │ gain per direction
//!                       │                ▼
//!                       ├──────────► unwrap ── cube ──► prefilter ── diffuse + specular maps ──► every StandardMaterial
//!                       │                                │
//!                       │     casters, real lights ──► shadows ── depth atlas + weight per direction
//!                       │                                │
//!                       └─ background                    ▼
//!                             └──────────► materials ── phantoms: camera × ratio;  virtual: diffuse × ratio, smooth or in bands
//! ```
//!
//! The modules are the stages in this order, and so are the sets of a frame, [`MirrorballSystems`] and [`MirrorballPasses`]; each
//! module's documentation says what enters, what leaves, what it costs and where its limits are. A stage uses only stages above
//! it, and all of them the ground floor: [`environment_map`]. [`mod@debug`] reads what they leave and shows how the measuring goes.
//!
//! # Cargo features
//! - `apriltag` (default): marker detection with the AprilTag C library; needs a C compiler.
//! - `webcam`: `CameraFeed::device`; on Linux building needs libclang.
//! - `egui`: `debug::MirrorballPanelPlugin`.
//!
//! # Frames of reference and units
//! World: Bevy's, right-handed, +Y up, metres. Marker: origin at the center of the black square, +X right, +Y out of the paper,
//! +Z to the bottom edge of the marker as the AprilTag project prints it; flat on a desk it has +Y up. Camera: Bevy's, looks along
//! −Z. Image: pixels, origin top-left, +v down, the first pixel's center at 0.5. Transforms are named `target_from_source`.
//!
//! Light is in *linear camera units*: 1.0 is the sensor's white, and shows as 1.0 in the frame buffer at any
//! [`Exposure`](bevy::camera::Exposure). A white virtual surface beside white paper comes out as white as the paper.
//!
//! # Drivers
//! A picture must not hang on what WGSL leaves open: the accuracy of `atan2`, `sin` and the like, filtering weights, what lies across
//! the edges of a cube, derivatives, not-a-number, the order of writes. So angles come from `trigonometry.wgsl`, tables and solid angles
//! from the CPU in double precision, cubes are read face by face (`environment_map/cubemap.wgsl`), multisampled prepasses where their sample lies,
//! and divisors are clamped. `tests/environment/shaders/loose_builtins.rs` lists each use of a loosely defined builtin with the reason why it is harmless.
//!
//! Each shader stage keeps within WebGPU's default limits, beside what Bevy binds for the view, the mesh and a `StandardMaterial`:
//!
//! | in a fragment of an [`ArCamera`](camera::ArCamera) | WebGPU | image-based or toon surface | of it ours |
//! |---|---|---|---|
//! | sampled textures | 16 | 16 | 1 |
//! | samplers | 16 | 13 | 1 |
//! | storage buffers | 8 | 7 | 3 |
//! | uniform buffers | 12 | 6 | 1 |
//!
//! There is no texture left: what comes next shares a binding. `tests/environment/device.rs` counts. Bevy itself goes beyond on native devices
//! (occlusion culling, its own environment filter) and leaves that out where it does not fit; its ambient occlusion needs a texture
//! more than there is. On WebGPU irradiance volumes are off, so that they need none.
//!
//! # Why does nothing happen?
//! The [`Checklist`](debug::Checklist) answers it in words while the game runs, and the panel of the feature `egui` shows it.
//!
//! - *The picture is not shown:* read the camera's [`FeedState`](camera::FeedState); a source that cannot be read is an error in
//!   the log.
//! - *The camera does not move:* [`MarkerTracking::state`](tracking::MarkerTracking::state) stays `Searching` until the marker is
//!   wholly in the picture, 40 pixels wide, sharp and with its white margin. One anchor needs [`WorldOrigin`](tracking::WorldOrigin).
//! - *Objects are misplaced:* without [`ArCamera::intrinsics`](camera::ArCamera::intrinsics) a field of view of 60° is assumed.
//! - *Objects are black:* [`ProbeMeasurement::is_in_view`](probe::ProbeMeasurement::is_in_view) says whether the ball is where
//!   the scene says, at least 12 pixels wide.
//! - *No shadows:* a [`ShadowDomeLight`](shadows::ShadowDomeLight) has to exist, the desk has to be a
//!   [`PhantomObject`](phantom::PhantomObject), and casters must not have `NotShadowCaster`.
//! - *Lights are colored oddly or too strong:* lower the camera's exposure until few pixels of the ball are clipped
//!   ([`ProbeMeasurement::clipped_fraction`](probe::ProbeMeasurement::clipped_fraction)), or give
//!   [shorter exposures](camera::BracketedFrames) beside it.

// In the order of the data flow, above the ground floor.
pub mod environment_map;

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
pub mod headless;
mod compute_pass;
mod device;
mod least_squares;
mod luminance;
mod median;
mod panic_text;
mod schedule;
mod trigonometry;

/// Old name of [`prefilter`] and [`environment_map`].
#[deprecated(
    since = "0.1.0",
    note = "use `prefilter` for what filters and lights, `environment_map` for the maps themselves"
)]
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
#[deprecated(since = "0.1.0", note = "use `headless`")]
#[doc(hidden)]
pub mod offscreen {
    pub use crate::headless::{HeadlessError as OffscreenError, *};
}

use bevy::{app::PluginGroupBuilder, prelude::*};

/// All of the crate. Add after [`DefaultPlugins`].
///
/// | plugin | does |
/// |---|---|
/// | [`camera::CameraPlugin`] | takes camera pictures in, shows them, projects like the real camera |
/// | [`tracking::TrackingPlugin`] | finds markers, moves the camera or the anchors |
/// | [`phantom::PhantomPlugin`] | tells real from virtual |
/// | [`probe::ProbePlugin`] | where the mirrored ball is, what it shows |
/// | [`lighting::LightingPlugin`] | what the camera clipped, from what stands on the desk |
/// | [`unwrap::UnwrapPlugin`] | frames → environment cube |
/// | [`prefilter::PrefilterPlugin`] | environment cube → light on every `StandardMaterial` |
/// | [`shadows::ShadowsPlugin`] | dome of shadow directions |
/// | [`materials::MaterialsPlugin`] | phantoms, image-based surfaces, toons |
/// | [`authoring::AuthoringPlugin`] | glTF extras → components |
/// | [`debug::MirrorballDiagnosticsPlugin`] | figures as Bevy diagnostics |
/// | [`debug::MapViewPlugin`] | pictures of the environment's maps |
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
    }
}

pub use schedule::{MirrorballPasses, MirrorballSystems};

/// What most games import.
pub mod prelude {
    pub use crate::{
        MirrorballPlugins,
        camera::{ArCamera, CameraFeed, CameraFrame, FeedPace, FrameFit, Intrinsics},
        materials::{SurfaceStyle, ToonStyle},
        phantom::PhantomObject,
        prefilter::LiveEnvironment,
        probe::LightProbeSphere,
        shadows::ShadowDomeLight,
        tracking::{MarkerAnchor, WorldOrigin},
    };
}

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeCodeCompiles;
