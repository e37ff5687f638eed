//! The virtual scene as an environment: what a scene probe sees in front of its background.

use crate::{cubes, gpu, sky_cube::sky_cube};
use bevy::{camera::visibility::RenderLayers, light::EnvironmentMapLight, prelude::*};
use bevy_mirrorball::{
    environment_map::{CubePixels, equirect_direction},
    prefilter::{EnvironmentState, PrefilterPlugin, SceneCube, SceneProbe},
};

/// Half floats, and the antialiasing that there is not.
const TOLERANCE: f32 = 2e-3;
/// Bilinear interpolation of a slope over texels 5.6° wide.
const SKY_TOLERANCE: f32 = 0.02;
const EDGE: u32 = 16;

/// A light gray sky, one axis per channel.
fn sky(dir: Vec3) -> Vec3 {
    1.0 + 0.5 * dir
}

/// Colored balls in all six directions, brighter than white, and a probe in their middle.
const BALLS: [(Vec3, Vec3); 6] = [
    (Vec3::X, Vec3::new(4.0, 0.0, 0.0)),
    (Vec3::NEG_X, Vec3::new(0.0, 4.0, 0.0)),
    (Vec3::Y, Vec3::new(0.0, 0.0, 4.0)),
    (Vec3::NEG_Y, Vec3::new(4.0, 4.0, 0.0)),
    (Vec3::Z, Vec3::new(0.0, 4.0, 4.0)),
    (Vec3::NEG_Z, Vec3::new(4.0, 0.0, 4.0)),
];

fn ball(app: &mut App, place: Vec3, color: Vec3, radius: f32) -> Entity {
    let mesh = Sphere::new(radius).mesh().ico(4).expect("few enough");
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
    let material = StandardMaterial { base_color: LinearRgba::from_vec3(color).into(), unlit: true, ..default() };
    let material = app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(material);
    app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::from_translation(place))).id()
}

const CENTER: Vec3 = Vec3::new(0.5, 1.0, -2.0);

fn scene(faces_per_frame: u32) -> Option<(App, Entity)> {
    let mut app = gpu::app(|app| {
        app.add_plugins(PrefilterPlugin);
    })?;
    let background = app.world_mut().resource_mut::<Assets<Image>>().add(sky_cube(EDGE, sky));
    for (dir, color) in BALLS {
        ball(&mut app, CENTER + dir, color, 0.3);
    }
    let probe = SceneProbe { edge: EDGE, faces_per_frame, background: Some(background), ..default() };
    // Turned and scaled, which must not matter.
    let place =
        Transform::from_translation(CENTER).with_rotation(Quat::from_rotation_y(0.7)).with_scale(Vec3::splat(3.0));
    let probe = app.world_mut().spawn((LightProbe::default(), probe, place)).id();
    Some((app, probe))
}

fn seen(app: &mut App, probe: Entity) -> CubePixels {
    let cube = app.world().get::<SceneCube>(probe).expect("has a cube").cube.clone();
    cubes::read(app, &cube)
}

fn run(app: &mut App, frames: usize) {
    for _ in 0..frames {
        app.update();
    }
}

#[test]
fn things_are_seen_where_they_are_and_the_sky_between_them() {
    let Some((mut app, probe)) = scene(6) else { return };
    run(&mut app, 4);
    let cube = seen(&mut app, probe);
    for (dir, color) in BALLS {
        let found = cube.sample(dir);
        assert!(found.distance(color) < TOLERANCE * 4.0, "{dir}: {found} instead of {color}");
    }
    let mut worst = 0.0_f32;
    for i in 0..200 {
        let dir = equirect_direction(Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 + 0.5) / 200.0));
        // Balls take 17.5° around the axes.
        if dir.abs().max_element() < 0.85 {
            worst = worst.max(cube.sample(dir).distance(sky(dir)));
        }
    }
    println!("sky between the balls off by {worst:.1e}");
    assert!(worst < SKY_TOLERANCE);
    let state = app.world().get::<EnvironmentState>(probe);
    assert!(matches!(state, Some(EnvironmentState::Live { refreshes: 1.., .. })), "{state:?}");
    assert!(app.world().entity(probe).contains::<EnvironmentMapLight>());
}

#[test]
fn only_due_faces_are_rendered() {
    let Some((mut app, probe)) = scene(1) else { return };
    let active = |app: &mut App| {
        let mut cameras = app.world_mut().query::<(&Camera, &Name)>();
        cameras.iter(app.world()).filter(|(camera, _)| camera.is_active).count()
    };
    for _ in 0..3 {
        app.update();
        assert_eq!(active(&mut app), 1);
    }
    run(&mut app, 12);
    let whole = seen(&mut app, probe);
    assert!(BALLS.iter().all(|(dir, color)| whole.sample(*dir).distance(*color) < TOLERANCE * 4.0));
    app.world_mut().get_mut::<SceneProbe>(probe).expect("it has one").faces_per_frame = 0;
    run(&mut app, 2);
    assert_eq!(active(&mut app), 0);
    let at = app.world().get::<Transform>(probe).expect("it is somewhere").translation + Vec3::X;
    ball(&mut app, at - 0.5 * Vec3::X, Vec3::ONE, 0.2);
    run(&mut app, 3);
    assert_eq!(seen(&mut app, probe), whole, "nothing was to be rendered");
}

#[test]
fn a_moving_thing_moves_and_what_is_on_another_layer_is_not_seen() {
    let Some((mut app, probe)) = scene(6) else { return };
    let near = ball(&mut app, CENTER + 0.5 * Vec3::X, Vec3::splat(2.0), 0.1);
    run(&mut app, 4);
    assert!(seen(&mut app, probe).sample(Vec3::X).distance(Vec3::splat(2.0)) < TOLERANCE * 2.0);
    app.world_mut().get_mut::<Transform>(near).expect("it is somewhere").translation = CENTER + 0.5 * Vec3::Y;
    run(&mut app, 2);
    let cube = seen(&mut app, probe);
    assert!(cube.sample(Vec3::Y).distance(Vec3::splat(2.0)) < TOLERANCE * 2.0);
    assert!(cube.sample(Vec3::X).distance(BALLS[0].1) < TOLERANCE * 4.0);
    app.world_mut().entity_mut(near).insert(RenderLayers::layer(5));
    run(&mut app, 2);
    assert!(seen(&mut app, probe).sample(Vec3::Y).distance(BALLS[2].1) < TOLERANCE * 4.0);
    app.world_mut().entity_mut(probe).insert(RenderLayers::layer(5));
    run(&mut app, 2);
    let cube = seen(&mut app, probe);
    assert!(cube.sample(Vec3::Y).distance(Vec3::splat(2.0)) < TOLERANCE * 2.0, "its own layer");
    assert!(cube.sample(Vec3::X).distance(sky(Vec3::X)) < SKY_TOLERANCE, "only its own layer");
}

#[test]
fn a_probe_taken_away_leaves_nothing() {
    let Some((mut app, probe)) = scene(2) else { return };
    run(&mut app, 2);
    let cameras = |app: &mut App| app.world_mut().query::<&Camera>().iter(app.world()).count();
    assert_eq!(cameras(&mut app), 6);
    app.world_mut().get_mut::<SceneProbe>(probe).expect("it has one").edge = 40;
    run(&mut app, 2);
    let edge = app.world().get::<SceneCube>(probe).map(|cube| cube.cube.clone()).expect("has a cube");
    let image = app.world().resource::<Assets<Image>>().get(&edge).expect("is there").width();
    assert_eq!((cameras(&mut app), image), (6, 64), "of another size");
    app.world_mut().entity_mut(probe).remove::<SceneProbe>();
    run(&mut app, 2);
    assert_eq!(cameras(&mut app), 0);
    assert!(!app.world().entity(probe).contains::<SceneCube>());
    assert!(!app.world().entity(probe).contains::<EnvironmentMapLight>());
}
