//! How does a thing become a drawing? Press T: image-based, toon, ink.
//!
//! `cargo run --example toon`

#[path = "support/mod.rs"]
mod support;

use bevy::prelude::*;
use bevy_mirrorball::prelude::*;
use support::DefaultPlugins; // Bevy's own, or with `--headless` a picture in a file

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, MirrorballPlugins))
        .add_systems(Startup, (film, setup))
        .add_systems(Update, switch_style)
        .run()
}

fn switch_style(keys: Res<ButtonInput<KeyCode>>, mut styles: Query<&mut SurfaceStyle>) {
    if !keys.just_pressed(KeyCode::KeyT) {
        return;
    }
    for mut style in &mut styles {
        *style = match *style {
            SurfaceStyle::ImageBased => SurfaceStyle::Toon(ToonStyle::default()),
            // Two steps of the room's light, and a line twice as thick.
            SurfaceStyle::Toon(ToonStyle { bands: 3, .. }) => {
                SurfaceStyle::Toon(ToonStyle { bands: 2, outline_width: 4.0, ..default() })
            }
            _ => SurfaceStyle::ImageBased,
        };
    }
}

fn setup(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    let [sphere, torus, capsule] = [
        Sphere::new(0.045).mesh().build(),
        Torus { minor_radius: 0.018, major_radius: 0.04 }.mesh().build(),
        Capsule3d::new(0.025, 0.06).mesh().build(),
    ]
    .map(|mesh| Mesh3d(meshes.add(mesh)));
    let [red, teal, yellow] = [Color::srgb(0.75, 0.12, 0.1), Color::srgb(0.1, 0.5, 0.5), Color::srgb(0.85, 0.65, 0.1)]
        .map(|color| MeshMaterial3d(materials.add(color)));
    // The style is a component of a thing, or of the root of a scene.
    let style = SurfaceStyle::ImageBased;
    commands.spawn((style, sphere, red, Transform::from_xyz(-0.13, 0.045, -0.02)));
    commands.spawn((style, torus, teal, Transform::from_xyz(0.02, 0.018, -0.14)));
    commands.spawn((style, capsule, yellow, Transform::from_xyz(-0.01, 0.055, 0.0)));
}

/// The photographed desk with marker and ball, as in the example `minimal`.
fn film(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>) {
    let intrinsics = Intrinsics::new(Vec2::splat(601.8), Vec2::new(320.0, 240.0), UVec2::new(640, 480));
    commands.spawn((ArCamera::new(intrinsics), CameraFeed::file("assets/desk/photo.jpg")));
    commands.spawn((MarkerAnchor::new(0, 0.10), WorldOrigin));
    commands.spawn((LightProbeSphere { radius: 0.05, ..default() }, Transform::from_xyz(0.17, 0.05, 0.01)));
    let desk = meshes.add(Plane3d::default().mesh().size(1.6, 1.2));
    commands.spawn((PhantomObject { casts: false, ..default() }, Mesh3d(desk)));
    commands.spawn(ShadowDomeLight::default());
}
