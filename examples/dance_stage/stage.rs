//! The virtual stage on the marker, and the keys that switch the style of its objects.

use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// Height of the dance floor in meters.
pub(crate) const FLOOR: f32 = 0.012;

/// Middle of the mirror ball, in meters.
pub(crate) const MIRROR_BALL: Vec3 = Vec3::new(-0.125, 0.105, 0.0);

/// Names of the objects that can be switched, in the order in which they are spawned.
pub(crate) const THINGS: [&str; 6] = ["dancer", "floor", "rim", "left loudspeaker", "right loudspeaker", "mirror ball"];

/// Names of the objects that start as toon.
#[derive(Resource)]
pub(crate) struct StartAsToon(pub Vec<&'static str>);

/// Spawns floor, loudspeakers and a mirror ball on a stand. The world's frame of reference is that of the
/// marker; the audience sits at −Z.
pub(crate) fn spawn(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let [_, floor, rim, left_speaker, right_speaker, mirror_ball] = THINGS;
    let mut paint = |color: Color, metallic: f32, perceptual_roughness: f32| {
        materials.add(StandardMaterial { base_color: color, metallic, perceptual_roughness, ..default() })
    };
    let wood = paint(Color::srgb(0.72, 0.55, 0.38), 0.0, 0.35);
    let gold = paint(Color::srgb(0.95, 0.78, 0.45), 1.0, 0.2);
    let chrome = paint(Color::srgb(0.92, 0.92, 0.94), 1.0, 0.06);
    let black = paint(Color::srgb(0.10, 0.10, 0.12), 0.0, 0.5);
    let teal = paint(Color::srgb(0.10, 0.55, 0.52), 0.0, 0.4);
    let mut shape = |thing: &mut EntityCommands, mesh: Mesh, material: &Handle<StandardMaterial>, at: Vec3| {
        let mesh = Mesh3d(meshes.add(mesh));
        thing.with_child((mesh, MeshMaterial3d(material.clone()), Transform::from_translation(at)));
    };
    let round = |radius: f32, height: f32| Cylinder::new(radius, height).mesh().resolution(64).build();

    let mut floor = thing(&mut commands, floor, Vec3::ZERO);
    shape(&mut floor, round(0.085, FLOOR), &wood, Vec3::Y * 0.5 * FLOOR);
    let mut rim = thing(&mut commands, rim, Vec3::ZERO);
    let ring = Torus { minor_radius: 0.0035, major_radius: 0.085 };
    shape(&mut rim, ring.mesh().major_resolution(64).minor_resolution(8).build(), &gold, Vec3::Y * FLOOR);
    for (name, x) in [(left_speaker, -0.105), (right_speaker, 0.1)] {
        let mut speaker = thing(&mut commands, name, Vec3::new(x, 0.0, 0.095));
        shape(&mut speaker, Cuboid::new(0.042, 0.075, 0.036).mesh().build(), &teal, Vec3::Y * 0.0375);
        for (height, radius) in [(0.054, 0.009), (0.025, 0.0145)] {
            let cone = Sphere::new(radius).mesh().uv(24, 12).scaled_by(Vec3::new(1.0, 1.0, 0.35));
            shape(&mut speaker, cone, &black, Vec3::new(0.0, height, -0.018));
        }
    }
    let mut mirror_ball = thing(&mut commands, mirror_ball, MIRROR_BALL.with_y(0.0));
    shape(&mut mirror_ball, round(0.018, 0.005), &black, Vec3::Y * 0.0025);
    shape(&mut mirror_ball, round(0.0025, 0.085), &black, Vec3::Y * 0.0425);
    shape(&mut mirror_ball, Sphere::new(0.024).mesh().uv(48, 24), &chrome, Vec3::Y * MIRROR_BALL.y);
}

/// Spawns a named object whose style can be switched.
pub(crate) fn thing<'a>(commands: &'a mut Commands, name: &'static str, at: Vec3) -> EntityCommands<'a> {
    let place = Transform::from_translation(at);
    commands.spawn((Name::new(name), SurfaceStyle::ImageBased, place, Visibility::default()))
}

/// The toon of all things: with a line that is thin enough for the dancer's face.
pub(crate) fn toon() -> SurfaceStyle {
    SurfaceStyle::Toon(ToonStyle { outline_width: 1.2, ..default() })
}

pub(crate) fn start_as_toon(toons: Res<StartAsToon>, mut styles: Query<(&Name, &mut SurfaceStyle)>) {
    for (_, mut style) in styles.iter_mut().filter(|(name, _)| toons.0.contains(&name.as_str())) {
        *style = toon();
    }
}

const NUMBER_KEYS: [KeyCode; 9] = [
    KeyCode::Digit1,
    KeyCode::Digit2,
    KeyCode::Digit3,
    KeyCode::Digit4,
    KeyCode::Digit5,
    KeyCode::Digit6,
    KeyCode::Digit7,
    KeyCode::Digit8,
    KeyCode::Digit9,
];

pub(crate) fn switch_styles(keys: Res<ButtonInput<KeyCode>>, mut styles: Query<(&Name, &mut SurfaceStyle)>) {
    // The panel lists them in this order too.
    let mut things: Vec<_> = styles.iter_mut().collect();
    things.sort_by_key(|(name, _)| (*name).clone());
    if keys.just_pressed(KeyCode::KeyT) {
        let all_toon = things.iter().all(|(_, style)| **style == toon());
        for (_, style) in &mut things {
            **style = if all_toon { SurfaceStyle::ImageBased } else { toon() };
        }
    }
    for ((_, style), key) in things.iter_mut().zip(NUMBER_KEYS) {
        if keys.just_pressed(key) {
            **style = if **style == toon() { SurfaceStyle::ImageBased } else { toon() };
        }
    }
}
