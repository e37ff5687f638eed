//! Scenes spawned by Bevy's own loader, without window and renderer.

use super::{DESK_FOLDER, complete_set, desk_components, document, folder, glb, write};
use bevy::{
    asset::{LoadState, UnapprovedPathMode},
    camera::{primitives::Aabb, visibility::VisibilityClass},
    gltf::{GltfExtras, GltfMaterialName, GltfMeshName, GltfPlugin},
    image::ImagePlugin,
    mesh::MeshPlugin,
    prelude::*,
    transform::components::TransformTreeChanged,
    world_serialization::WorldSerializationPlugin,
};
use bevy_mirrorball::{
    authoring::{AuthoredComponent, AuthoringPlugin, AuthoringReport, read_scene_components},
    phantom::PhantomObject,
    probe::ClipRecovery,
    tracking::{PoseFilter, WorldOrigin},
};
use serde_json::json;
use std::{
    path::Path,
    time::{Duration, Instant},
};

/// A loader that takes longer than this is stuck; the file has a few hundred bytes.
const LOADING_LIMIT: Duration = Duration::from_secs(60);

/// Loads and spawns a scene with Bevy's loader, without window and renderer, until the frame that has its nodes.
fn spawn_scene(folder: &Path, file: &'static str) -> App {
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins,
        AssetPlugin {
            file_path: folder.display().to_string(),
            unapproved_path_mode: UnapprovedPathMode::Deny,
            ..default()
        },
        TransformPlugin,
        ImagePlugin::default(),
        MeshPlugin,
        WorldSerializationPlugin,
        GltfPlugin::default(),
        AuthoringPlugin,
    ));
    // games get these from Bevy's feature `reflect_auto_register`; the spawner panics about a type it does not know
    app.register_type::<ChildOf>()
        .register_type::<Children>()
        .register_type::<Name>()
        .register_type::<Transform>()
        .register_type::<GlobalTransform>()
        .register_type::<TransformTreeChanged>()
        .register_type::<Visibility>()
        .register_type::<InheritedVisibility>()
        .register_type::<ViewVisibility>()
        .register_type::<VisibilityClass>()
        .register_type::<Mesh3d>()
        .register_type::<Aabb>()
        .register_type::<GltfExtras>()
        .register_type::<GltfMeshName>()
        .register_type::<GltfMaterialName>();
    app.finish();
    app.cleanup();

    let scene = app.world().resource::<AssetServer>().load(GltfAssetLabel::Scene(0).from_asset(file));
    app.world_mut().spawn(WorldAssetRoot(scene.clone()));
    let start = Instant::now();
    let mut nodes = app.world_mut().query::<&GltfExtras>();
    while nodes.iter(app.world()).next().is_none() {
        app.update();
        if let LoadState::Failed(error) = app.world().resource::<AssetServer>().load_state(&scene) {
            panic!("{file}: {error}");
        }
        assert!(start.elapsed() < LOADING_LIMIT, "{file} is not spawned after {LOADING_LIMIT:?}");
        std::thread::sleep(Duration::from_millis(1));
    }
    app
}

/// The node of this name, which must be the only one.
fn node<'w>(app: &'w mut App, name: &str) -> EntityRef<'w> {
    let mut named = app.world_mut().query::<(Entity, &Name)>();
    let mut found = named.iter(app.world()).filter(|(_, found)| found.as_str() == name);
    let (entity, _) = found.next().unwrap_or_else(|| panic!("no node {name}"));
    assert!(found.next().is_none(), "two nodes {name}");
    app.world().entity(entity)
}

/// Asserts that the node carries these of our components and no others. Anchors and balls have a filter and a recovery
/// by themselves, with the default settings.
fn assert_components(node: EntityRef, expected: &[AuthoredComponent]) {
    let mut found = Vec::new();
    let recovery = node.get().filter(|recovery| **recovery != ClipRecovery::default());
    found.extend(recovery.cloned().map(AuthoredComponent::ClipRecovery));
    found.extend(node.get().cloned().map(AuthoredComponent::LightProbeSphere));
    found.extend(node.get().cloned().map(AuthoredComponent::MarkerAnchor));
    found.extend(node.get().cloned().map(AuthoredComponent::MarkerBoard));
    found.extend(node.get().cloned().map(AuthoredComponent::PhantomObject));
    let filter = node.get().filter(|filter| **filter != PoseFilter::default());
    found.extend(filter.cloned().map(AuthoredComponent::PoseFilter));
    found.extend(node.get().cloned().map(AuthoredComponent::ShadowDomeLight));
    found.extend(node.get().cloned().map(AuthoredComponent::SurfaceStyle));
    found.extend(node.get().cloned().map(AuthoredComponent::WorldOrigin));
    assert_eq!(found, expected);
}

#[test]
fn a_spawned_scene_has_its_components_in_the_frame_that_spawns_it() {
    write("spawned.glb", &glb(&complete_set()));
    let mut app = spawn_scene(&folder(), "spawned.glb");
    for expected in read_scene_components(&folder().join("spawned.glb")).expect("a faultless set") {
        assert_components(node(&mut app, &expected.node), &expected.components);
    }
    assert_components(node(&mut app, "plain"), &[]);
    let report = app.world().resource::<AuthoringReport>();
    assert_eq!(report.errors, []);
    assert_eq!(report.warnings.len(), 1);
}

#[test]
fn a_spawned_mistake_names_the_file_and_spares_the_rest() {
    let mut set = document(json!([
        {"name": "marker", "extras": {"WorldOrigin": {}}, "children": [1]},
        {"name": "ball", "extras": {"LightProbeSphere": {"radius": 0}, "PhantomObject": {}}},
    ]));
    set["scenes"][0]["nodes"] = json!([0]);
    write("spawned_mistake.gltf", set.to_string().as_bytes());
    let mut app = spawn_scene(&folder(), "spawned_mistake.gltf");
    assert_components(node(&mut app, "marker"), &[AuthoredComponent::WorldOrigin(WorldOrigin)]);
    assert_components(node(&mut app, "ball"), &[AuthoredComponent::PhantomObject(PhantomObject::default())]);

    let report = app.world().resource::<AuthoringReport>();
    let texts: Vec<_> = report.errors.iter().map(ToString::to_string).collect();
    assert_eq!(
        texts,
        ["spawned_mistake.gltf, node \"ball\": LightProbeSphere.radius is 0, which is not accepted; write a number \
          above 0 (meters), or leave it out for the default"]
    );
}

#[test]
fn the_spawned_desk_model_has_its_components() {
    let mut app = spawn_scene(Path::new(DESK_FOLDER), "desk.glb");
    for (_, name, expected) in desk_components() {
        assert_components(node(&mut app, name), &expected);
    }
    for name in ["white ball", "gold ball", "red ring"] {
        assert_components(node(&mut app, name), &[]);
    }
    assert_eq!(*app.world().resource::<AuthoringReport>(), AuthoringReport::default());
}
