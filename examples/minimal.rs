//! Virtual things on a photographed desk, in the light of its room: `cargo run --example minimal`

#[path = "support/mod.rs"]
mod support;

use bevy::prelude::*;
use bevy_mirrorball::prelude::*;
use support::DefaultPlugins; // Bevy's own, or with `--headless` a picture in a file

fn main() -> AppExit {
    App::new().add_plugins((DefaultPlugins, MirrorballPlugins)).add_systems(Startup, setup).run()
}

fn setup(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    // The real camera: its frames are the background, and the game camera gets its pose.
    let intrinsics = Intrinsics::new(Vec2::splat(601.8), Vec2::new(320.0, 240.0), UVec2::new(640, 480));
    commands.spawn((ArCamera::new(intrinsics), CameraFeed::file("assets/desk/photo.jpg")));
    // The printed marker number 0, 10 cm wide: the origin of the world.
    commands.spawn((MarkerAnchor::new(0, 0.10), WorldOrigin));
    // The mirrored ball beside it, which shows the light of the room.
    commands.spawn((LightProbeSphere { radius: 0.05, ..default() }, Transform::from_xyz(0.17, 0.05, 0.01)));
    // The real desk, which catches shadows, from 64 directions in the colors of the room.
    let desk = meshes.add(Plane3d::default().mesh().size(1.6, 1.2));
    commands.spawn((PhantomObject { casts: false, ..default() }, Mesh3d(desk)));
    commands.spawn(ShadowDomeLight::default());
    // Virtual things, with Bevy's own meshes and materials.
    let (sphere, cube) = (meshes.add(Sphere::new(0.045)), meshes.add(Cuboid::from_length(0.06)));
    let gold = StandardMaterial { metallic: 1.0, perceptual_roughness: 0.2, ..Color::srgb(0.95, 0.78, 0.45).into() };
    let (gold, red) = (materials.add(gold), materials.add(Color::srgb(0.7, 0.1, 0.08)));
    commands.spawn((Mesh3d(sphere), MeshMaterial3d(gold), Transform::from_xyz(-0.13, 0.045, -0.03)));
    commands.spawn((Mesh3d(cube), MeshMaterial3d(red), Transform::from_xyz(0.02, 0.03, -0.12)));
}
