//! The dance stage on the recorded desk, with one effect.

use crate::{
    dancer, stage,
    support::{Outcome, frame_time},
};
use bevy::{gltf::GltfAssetLabel, prelude::*, time::TimeUpdateStrategy};
use bevy_mirrorball::{headless, materials::NeighborReflections, prelude::*, probe::is_lit_by_measurement};
use std::time::Duration;

/// Size of the picture, that of the recording.
pub(crate) const SIZE: UVec2 = UVec2::new(640, 480);
/// Time from frame to frame.
const STEP: Duration = Duration::from_nanos(1_000_000_000 / 15);
/// Number of frames before the measurement.
const WARM_UP: usize = 8;
const CLIP: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/desk_clip");
const FIRST_FRAME: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/desk_clip/frame_000.jpg");
/// Horizontal field of view of the recording in radians, as its `clip.json` has it.
const FIELD_OF_VIEW: f32 = 0.977;
/// Longest wait for the scene and its light.
const MAX_WAIT: Duration = Duration::from_secs(120);

/// What changes from frame to frame.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Case {
    Still,
    /// The dancer moves.
    Dance,
    /// The dancer, the camera and a lamp move.
    Live,
}

impl Case {
    pub(crate) const ALL: [Self; 3] = [Self::Still, Self::Dance, Self::Live];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Still => "still",
            Self::Dance => "dance",
            Self::Live => "live",
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Effect {
    Bounce,
    Neighbors,
    Grain,
    All,
}

impl Effect {
    pub(crate) const ALL: [Self; 4] = [Self::Bounce, Self::Neighbors, Self::Grain, Self::All];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Bounce => "bounce",
            Self::Neighbors => "neighbors",
            Self::Grain => "grain",
            Self::All => "all",
        }
    }
}

/// The stage with one effect, or with none.
pub(crate) struct Desk {
    pub(crate) app: App,
}

fn spawn_dancer(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let mut dancer = stage::thing(&mut commands, stage::THINGS[0], Vec3::Y * stage::FLOOR);
    dancer.insert(dancer::Dancer);
    dancer::spawn(&mut dancer, &mut meshes, &mut materials);
}

impl Desk {
    pub(crate) fn new(case: Case, effect: Option<Effect>) -> Outcome<Self> {
        let has = |one: Effect| effect.is_some_and(|effect| effect == one || effect == Effect::All);
        let mut app = headless::build_app(headless::default_plugins(), |app| {
            app.add_plugins(MirrorballPlugins)
                .insert_resource(TimeUpdateStrategy::ManualDuration(STEP))
                .insert_resource(dancer::Dance { is_held: true, ..default() })
                .add_systems(Startup, (spawn_dancer, stage::spawn).chain())
                .add_systems(Update, (dancer::keep_the_beat, dancer::dance).chain());
            if !has(Effect::Neighbors) {
                app.insert_resource(NeighborReflections { max_probes: 0, ..default() });
            }
        })?;
        let (_, target) = headless::add_target(&mut app, SIZE);
        let world = app.world_mut();
        let set = world.resource::<AssetServer>().load(GltfAssetLabel::Scene(0).from_asset("desk/set.glb"));
        world.spawn(WorldAssetRoot(set));
        let surfels = if has(Effect::Bounce) { ShadowDomeLight::default().surfels } else { 0 };
        world.spawn(ShadowDomeLight { surfels, ..default() });
        let intrinsics = Some(Intrinsics::from_horizontal_fov(SIZE, FIELD_OF_VIEW));
        let mut camera = world.spawn((ArCamera { intrinsics, ..default() }, CameraFeed::file(FIRST_FRAME), target));
        if has(Effect::Grain) {
            camera.insert(CameraGrain::default());
        }
        let camera = camera.id();
        headless::update_until(&mut app, "the light of the desk", MAX_WAIT, |app| {
            app.world_mut().run_system_cached(is_lit_by_measurement).unwrap_or(false)
        })?;
        headless::settle(&mut app)?;
        // Mirrors are up to date only while nothing moves.
        let world = app.world_mut();
        world.resource_mut::<dancer::Dance>().is_held = case == Case::Still;
        if case == Case::Live {
            world.entity_mut(camera).insert(CameraFeed::clip(CLIP).with_pace(FeedPace::Lockstep));
        }
        (0..WARM_UP).try_for_each(|_| frame_time(&mut app).map(drop))?;
        Ok(Self { app })
    }
}
