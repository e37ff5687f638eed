//! The event that a probe begins to give light.

use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels},
    prelude::*,
    probe::{EnvironmentMeasured, LightProbeCamera, ProbeCameraState, ProbePlugin, is_lit_by_measurement},
};

const SIZE: UVec2 = UVec2::new(64, 48);

/// Probes and cameras of the events since the last look, and the number of updates with measured light.
#[derive(Resource, Default)]
struct Log(Vec<(Entity, Entity)>, u32);

/// What measures without drawing.
fn app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, AssetPlugin::default(), ImagePlugin::default(), TransformPlugin))
        .init_asset::<Shader>()
        .add_plugins((CameraPlugin, ProbePlugin))
        .init_resource::<Log>()
        .add_observer(|measured: On<EnvironmentMeasured>, mut log: ResMut<Log>| {
            log.0.push((measured.entity, measured.camera));
        })
        .add_systems(Last, (|mut log: ResMut<Log>| log.1 += 1).run_if(is_lit_by_measurement));
    app
}

fn frame() -> CameraFeed {
    let pixels = FramePixels::new(SIZE, vec![128; 4 * SIZE.element_product() as usize]).expect("fits");
    CameraFeed::pixels(pixels).with_pace(FeedPace::Lockstep)
}

/// A new frame arrives at a camera.
fn show(app: &mut App, camera: Entity) -> Vec<(Entity, Entity)> {
    app.world_mut().entity_mut(camera).insert(frame());
    app.update();
    std::mem::take(&mut app.world_mut().resource_mut::<Log>().0)
}

#[test]
fn a_ball_is_measured_first_when_it_comes_into_view() {
    let mut app = app();
    let intrinsics = Intrinsics::from_horizontal_fov(SIZE, 1.0);
    let camera = app.world_mut().spawn(ArCamera::new(intrinsics)).id();
    assert_eq!(show(&mut app, camera), []);
    let ball = app.world_mut().spawn((LightProbeSphere::default(), Transform::from_xyz(0.0, 0.0, -0.3))).id();
    let dark = LightProbeSphere { reflectance: 0.04, ..default() };
    app.world_mut().spawn((dark, Transform::from_xyz(0.05, 0.0, -0.3)));
    assert_eq!(app.world().resource::<Log>().1, 0);
    assert_eq!(show(&mut app, camera), [(ball, camera)], "dark balls give no light");
    assert_eq!(app.world().resource::<Log>().1, 1, "measured light counts from the same update on");
    for _ in 0..3 {
        assert_eq!(show(&mut app, camera), [], "once, not in every frame");
    }
    let move_to =
        |app: &mut App, z: f32| app.world_mut().get_mut::<Transform>(ball).expect("has one").translation.z = z;
    move_to(&mut app, 1.0);
    assert_eq!(show(&mut app, camera), [], "behind the camera");
    move_to(&mut app, -0.3);
    assert_eq!(show(&mut app, camera), [(ball, camera)], "back");
    assert_eq!(app.world().resource::<Log>().1, 6, "measured light stays");
}

#[test]
fn a_probe_camera_measures_from_its_first_frame_on() {
    let mut app = app();
    let camera = app.world_mut().spawn(LightProbeCamera::default()).id();
    app.update();
    assert_eq!(app.world().resource::<Log>().0, []);
    assert_eq!(show(&mut app, camera), [(camera, camera)]);
    assert_eq!(show(&mut app, camera), []);
    app.world_mut().entity_mut(camera).insert(LightProbeCamera { gain: Vec3::ZERO, ..default() });
    assert_eq!(show(&mut app, camera), []);
    assert_ne!(app.world().get(camera), Some(&ProbeCameraState::Measuring));
    app.world_mut().entity_mut(camera).insert(LightProbeCamera::default());
    assert_eq!(show(&mut app, camera), [(camera, camera)], "valid again");
}
