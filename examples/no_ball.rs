//! What if there is a marker, but no mirrored ball? The light is then that of a file, or of a sky fitted to the frame
//! and to the white of the marker's paper.
//!
//! `cargo run --example no_ball`

#[path = "support/mod.rs"]
mod support;

use bevy::prelude::*;
use bevy_mirrorball::{
    prelude::*,
    probe::{EnvironmentFallback, EnvironmentOrigin},
};
use support::DefaultPlugins; // Bevy's own, or with `--headless` a picture in a file

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, MirrorballPlugins))
        .add_systems(Startup, setup)
        .add_systems(Update, say_where_light_comes_from)
        .run()
}

fn setup(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    // Every `ArCamera` has a fallback; this one prefers the map of the room that a game saved when there was a ball.
    // Without that file the light is a sky fitted to the frame.
    let fallback = EnvironmentFallback { saved: Some("room.hdr".into()), ..default() };
    let intrinsics = Intrinsics::new(Vec2::splat(601.8), Vec2::new(320.0, 240.0), UVec2::new(640, 480));
    commands.spawn((ArCamera::new(intrinsics), CameraFeed::file("assets/desk/photo.jpg"), fallback));
    commands.spawn((MarkerAnchor::new(0, 0.10), WorldOrigin));
    let desk = meshes.add(Plane3d::default().mesh().size(1.6, 1.2));
    commands.spawn((PhantomObject { casts: false, ..default() }, Mesh3d(desk)));
    commands.spawn(ShadowDomeLight::default());

    let (sphere, cube) = (meshes.add(Sphere::new(0.045)), meshes.add(Cuboid::from_length(0.06)));
    let (white, red) = (materials.add(Color::WHITE), materials.add(Color::srgb(0.7, 0.1, 0.08)));
    commands.spawn((Mesh3d(sphere), MeshMaterial3d(white), Transform::from_xyz(-0.13, 0.045, -0.03)));
    commands.spawn((Mesh3d(cube), MeshMaterial3d(red), Transform::from_xyz(0.02, 0.03, -0.12)));
}

fn say_where_light_comes_from(origins: Query<&EnvironmentOrigin, Changed<EnvironmentOrigin>>) {
    for origin in &origins {
        println!("light: {origin:?}");
    }
}
