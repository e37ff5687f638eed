//! How do several markers go together? One is the origin of the world and holds still; the others move in it, and
//! their children with them.
//!
//! `cargo run --example two_markers`

#[path = "support/mod.rs"]
mod support;

use bevy::prelude::*;
use bevy_mirrorball::{prelude::*, tracking::MarkerTracking};
use support::DefaultPlugins; // Bevy's own, or with `--headless` a picture in a file

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, MirrorballPlugins))
        .add_systems(Startup, setup)
        .add_systems(Update, say_where_they_are)
        .run()
}

fn setup(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    let intrinsics = Intrinsics::new(Vec2::splat(601.8), Vec2::new(320.0, 240.0), UVec2::new(640, 480));
    commands.spawn((ArCamera::new(intrinsics), CameraFeed::file("assets/desk/two_markers.jpg")));
    commands.spawn(ShadowDomeLight::default());

    let (plate, cube) = (meshes.add(Cylinder::new(0.05, 0.01)), meshes.add(Cuboid::from_length(0.06)));
    let (white, red) = (materials.add(Color::WHITE), materials.add(Color::srgb(0.7, 0.1, 0.08)));
    let desk = meshes.add(Plane3d::default().mesh().size(1.6, 1.2));
    commands.spawn((
        Name::new("number 0"),
        MarkerAnchor::new(0, 0.10),
        WorldOrigin,
        children![
            (LightProbeSphere { radius: 0.05, ..default() }, Transform::from_xyz(0.17, 0.05, 0.01)),
            (PhantomObject { casts: false, ..default() }, Mesh3d(desk)),
            (Mesh3d(plate), MeshMaterial3d(white), Transform::from_xyz(0.0, 0.005, 0.0)),
        ],
    ));
    commands.spawn((
        Name::new("number 1"),
        MarkerAnchor::new(1, 0.10),
        children![(Mesh3d(cube), MeshMaterial3d(red), Transform::from_xyz(0.0, 0.03, 0.0))],
    ));
}

/// Markers are measured each by itself: what stands on them stays there however they are moved.
fn say_where_they_are(markers: Query<(&Name, &Transform, &MarkerTracking), Changed<MarkerTracking>>) {
    for (name, place, tracking) in &markers {
        println!("{name}: {:?} at {:.3} m", tracking.state, place.translation);
    }
}
