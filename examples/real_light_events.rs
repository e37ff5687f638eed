//! How does a game hear of the lamps in the room? Each is an entity that comes and goes with the lamp; here each gets
//! an arrow that points at it, in the color of its light.
//!
//! `cargo run --example real_light_events`

#[path = "support/mod.rs"]
mod support;

use bevy::{light::NotShadowCaster, prelude::*};
use bevy_mirrorball::{
    lighting::{RealLight, RealLightAppeared, RealLightVanished},
    prelude::*,
};
use support::DefaultPlugins; // Bevy's own, or with `--headless` a picture in a file

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, MirrorballPlugins))
        .add_systems(Startup, setup)
        .add_observer(greet)
        .add_observer(take_leave)
        .add_systems(Update, point_at_lamps)
        .run()
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    // A recording of a desk; it knows the lens of its camera.
    commands.spawn((ArCamera::default(), CameraFeed::clip("assets/desk_clip")));
    // Marker, ball and the real things on the desk: their shadows say how bright the lamps are.
    commands.spawn(WorldAssetRoot(assets.load(GltfAssetLabel::Scene(0).from_asset("desk/set.glb"))));
}

fn greet(
    appeared: On<RealLightAppeared>,
    lights: Query<&RealLight>,
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let Ok(light) = lights.get(appeared.entity) else { return };
    println!("light {} appeared: {:.0} % of all light", light.id, 100.0 * light.fraction);
    let arrow = meshes.add(Cone::new(0.008, 0.05));
    let paint = materials.add(StandardMaterial { base_color: light.color.into(), unlit: true, ..default() });
    // Whatever is inserted here, or added as a child, goes when the light goes.
    commands.entity(appeared.entity).insert((Mesh3d(arrow), MeshMaterial3d(paint), NotShadowCaster));
}

fn take_leave(vanished: On<RealLightVanished>) {
    println!("light {} vanished", vanished.id);
}

fn point_at_lamps(mut arrows: Query<(&RealLight, &mut Transform), With<Mesh3d>>) {
    for (light, mut transform) in &mut arrows {
        let turn = Quat::from_rotation_arc(Vec3::Y, light.direction);
        *transform = Transform::from_translation(0.12 * light.direction).with_rotation(turn);
    }
}
