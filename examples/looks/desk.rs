//! The recorded desk, and three virtual things on it: a round one, an animal, one with hard edges.

use crate::{
    look::{Looks, Thing},
    ramps::paint_ramps,
};
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// Folder of the recording, in the folder of assets.
pub(crate) const CLIP: &str = "desk_clip";
/// The recorded frame that shows the things best, with the lamp in front of them on the left.
pub(crate) const STILL: &str = "desk_clip/frame_028.jpg";
/// Names of the things, from left to right.
pub(crate) const THINGS: [&str; 3] = ["teapot", "fox", "block"];

/// Looks of the things when they are spawned.
#[derive(Resource)]
struct StartLooks(Looks);

/// Adds the desk and the things to a program. The camera is left to it, because a recording plays in a window and
/// stands still in a picture.
pub(crate) fn build(app: &mut App, looks: Looks) {
    app.add_plugins(MirrorballPlugins)
        .insert_resource(StartLooks(looks))
        .add_systems(Startup, (set, things))
        .add_systems(Update, paint_ramps);
}

/// What is really there, as a scene: marker, mirrored ball, and the desk, the box and the can that hide virtual things
/// and catch their shadows. The shadow dome is in it, too.
fn set(mut commands: Commands, assets: Res<AssetServer>) {
    commands.spawn(WorldAssetRoot(assets.load(GltfAssetLabel::Scene(0).from_asset("desk/set.glb"))));
}

/// The world's frame of reference is that of the marker; the camera looks along +Z, so that +X is on the left.
fn things(
    mut commands: Commands,
    looks: Res<StartLooks>,
    assets: Res<AssetServer>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let [teapot, fox, block] = THINGS.map(|name| {
        let look = looks.0.get(name).cloned().unwrap_or_default();
        (Thing, Name::new(name), look, Visibility::default())
    });
    let scene = |file| WorldAssetRoot(assets.load(GltfAssetLabel::Scene(0).from_asset(file)));
    let place =
        |x, z, degrees: f32| Transform::from_xyz(x, 0.0, z).with_rotation(Quat::from_rotation_y(degrees.to_radians()));
    commands.spawn((teapot, scene("models/teapot.glb"), place(0.13, -0.16, 200.0)));
    // 155 units long
    let fox_size = Vec3::splat(0.165 / 155.0);
    commands.spawn((fox, scene("models/Fox.gltf"), place(-0.02, -0.19, 145.0).with_scale(fox_size)));
    // Alpha is the gloss map of `ClassicModel::GlossMap`, and has no meaning for other styles of opaque materials.
    let paint = StandardMaterial {
        base_color: Color::srgba(0.82, 0.35, 0.14, 0.75),
        perceptual_roughness: 0.35,
        alpha_mode: AlphaMode::Opaque,
        ..default()
    };
    let size = Vec3::splat(0.065);
    commands.spawn((block, place(-0.15, -0.15, 35.0))).with_child((
        Mesh3d(meshes.add(Cuboid::from_size(size))),
        MeshMaterial3d(materials.add(paint)),
        Transform::from_xyz(0.0, 0.5 * size.y, 0.0),
    ));
}
