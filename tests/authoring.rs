//! Authored glTF files become components: read from disk, and spawned by Bevy's own loader without a GPU.

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
    authoring::{
        AuthoredComponent, AuthoringError, AuthoringPlugin, AuthoringReport, ExtrasProblem, NodeComponents,
        read_scene_components,
    },
    materials::{SurfaceStyle, ToonStyle},
    phantom::PhantomObject,
    probe::LightProbeSphere,
    shadows::ShadowDomeLight,
    tracking::{MarkerAnchor, WorldOrigin},
};
use serde_json::{Value, json};
use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// A loader that takes longer than this is stuck; the file has a few hundred bytes.
const LOADING_LIMIT: Duration = Duration::from_secs(60);

/// The folder that the tests write their files into, inside the target folder.
fn folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("authoring")
}

/// Writes a file for one test; tests run at the same time, so every test has its own name.
fn write(name: &str, bytes: &[u8]) -> PathBuf {
    std::fs::create_dir_all(folder()).expect("the target folder is writable");
    let path = folder().join(name);
    std::fs::write(&path, bytes).expect("the target folder is writable");
    path
}

/// A glTF document of these nodes, all of them roots of its only scene.
fn document(nodes: Value) -> Value {
    let roots: Vec<_> = (0..nodes.as_array().expect("a list of nodes").len()).collect();
    json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": roots}], "nodes": nodes})
}

/// Binary glTF with nothing but a JSON chunk.
fn glb(document: &Value) -> Vec<u8> {
    let mut chunk = document.to_string().into_bytes();
    chunk.resize(chunk.len().next_multiple_of(4), b' ');
    let length = |bytes: usize| u32::try_from(bytes).expect("a small file").to_le_bytes();
    let mut file = b"glTF\x02\0\0\0".to_vec();
    file.extend(length(20 + chunk.len()));
    file.extend(length(chunk.len()));
    file.extend(b"JSON");
    file.extend(chunk);
    file
}

/// A set with every component once; one node without a name, one without extras.
fn complete_set() -> Value {
    document(json!([
        {"name": "marker", "extras": {"MarkerAnchor": {"family": "tag36h11", "id": 7, "size": 0.2}, "WorldOrigin": {}}},
        {"name": "ball", "extras": {"LightProbeSphere": {"radius": 0.03}, "cycles": {"samples": 4}}},
        {"name": "plain"},
        {"extras": {"PhantomObject": {"casts": false}}},
        {"name": "dome", "extras": {"ShadowDomeLight": {"directions": 16}, "shadowdomelight": 1}},
        {"name": "robot", "extras": {"SurfaceStyle": "Toon"}},
        {"name": "ink", "extras": {"SurfaceStyle": {"Toon": {"bands": 2, "outline_width": 3.5}}}},
    ]))
}

fn components_of(nodes: &[NodeComponents]) -> Vec<(usize, &str, Vec<AuthoredComponent>)> {
    nodes.iter().map(|node| (node.index, node.node.as_str(), node.components.clone())).collect()
}

#[test]
fn text_and_binary_files_give_the_same_components() {
    let expected = vec![
        (
            0,
            "marker",
            vec![
                AuthoredComponent::MarkerAnchor(MarkerAnchor::new(7, 0.2)),
                AuthoredComponent::WorldOrigin(WorldOrigin),
            ],
        ),
        (1, "ball", vec![AuthoredComponent::LightProbeSphere(LightProbeSphere { radius: 0.03, ..default() })]),
        (3, "GltfNode3", vec![AuthoredComponent::PhantomObject(PhantomObject { casts: false, ..default() })]),
        (4, "dome", vec![AuthoredComponent::ShadowDomeLight(ShadowDomeLight { directions: 16, ..default() })]),
        (5, "robot", vec![AuthoredComponent::SurfaceStyle(SurfaceStyle::Toon(default()))]),
        (
            6,
            "ink",
            vec![AuthoredComponent::SurfaceStyle(SurfaceStyle::Toon(ToonStyle {
                bands: 2,
                outline_width: 3.5,
                ..default()
            }))],
        ),
    ];
    let set = complete_set();
    for path in [write("complete.gltf", set.to_string().as_bytes()), write("complete.glb", &glb(&set))] {
        let nodes = read_scene_components(&path).expect("a faultless set");
        assert_eq!(components_of(&nodes), expected);
        let warnings: Vec<_> = nodes.iter().flat_map(|node| &node.warnings).map(|w| (&*w.key, w.meant)).collect();
        assert_eq!(warnings, [("shadowdomelight", "ShadowDomeLight")]);
    }
}

#[test]
fn the_mistakes_of_all_nodes_are_reported_together() {
    let set = document(json!([
        {"name": "marker", "extras": {"MarkerAnchor": {"id": 0}}},
        {"name": "fine", "extras": {"WorldOrigin": {}}},
        {"name": "ball", "extras": {"LightProbeSphere": {"radius": -1, "colour": "red"}}},
    ]));
    let path = write("mistakes.glb", &glb(&set));
    let error = read_scene_components(&path).expect_err("three mistakes");
    let AuthoringError::Extras(errors) = &error else { panic!("{error:?}") };
    let places: Vec<_> = errors.iter().map(|error| error.context.node.as_str()).collect();
    assert_eq!(places, ["marker", "ball", "ball"]);
    assert!(matches!(errors[0].problem, ExtrasProblem::MissingField { field: "size", .. }));
    assert!(matches!(errors[1].problem, ExtrasProblem::OutOfRange { field: "radius", .. }));
    assert!(matches!(&errors[2].problem, ExtrasProblem::UnknownField { field, .. } if field == "colour"));

    let text = error.to_string();
    assert_eq!(text.lines().count(), 3, "{text}");
    let file = path.display().to_string();
    assert!(text.lines().all(|line| line.starts_with(&file)), "{text}");
}

#[test]
fn a_missing_file_is_unreadable() {
    let error = read_scene_components(&folder().join("nowhere.glb")).expect_err("no such file");
    assert!(matches!(error, AuthoringError::Unreadable { .. }), "{error:?}");
    assert!(error.to_string().contains("nowhere.glb"), "{error}");
}

#[test]
fn other_files_are_not_gltf() {
    let mut version_1 = glb(&complete_set());
    version_1[4] = 1;
    let mut empty_length = glb(&complete_set());
    empty_length[8..12].fill(0);
    for (name, bytes) in [
        ("empty.gltf", &b""[..]),
        ("letter.gltf", b"Dear artist, here is the desk."),
        ("list.gltf", b"[]"),
        ("no_asset.gltf", b"{\"nodes\": []}"),
        ("version_1.glb", &version_1),
        ("empty_length.glb", &empty_length),
    ] {
        let error = read_scene_components(&write(name, bytes)).expect_err(name);
        assert!(matches!(error, AuthoringError::NotGltf { .. }), "{name}: {error:?}");
        assert!(error.to_string().contains(name), "{error}");
    }
}

#[test]
fn a_file_cut_off_anywhere_is_not_gltf() {
    let whole = glb(&complete_set());
    for length in 0..whole.len() {
        let error = read_scene_components(&write("cut.glb", &whole[..length])).expect_err("cut off");
        assert!(matches!(error, AuthoringError::NotGltf { .. }), "{length} bytes: {error:?}");
    }
}

#[test]
fn required_extensions_that_nobody_can_read_are_named() {
    let mut set = complete_set();
    set["extensionsUsed"] = json!(["KHR_draco_mesh_compression", "ACME_paint"]);
    set["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    let error = read_scene_components(&write("draco.glb", &glb(&set))).expect_err("Draco is not supported");
    let AuthoringError::UnsupportedExtensions { extensions, .. } = &error else { panic!("{error:?}") };
    assert_eq!(extensions, &["KHR_draco_mesh_compression"]);
}

#[test]
fn contradictions_are_listed_with_their_place() {
    let mut set = complete_set();
    set["scene"] = json!(3);
    set["nodes"][2]["mesh"] = json!(5);
    let error = read_scene_components(&write("contradictions.gltf", set.to_string().as_bytes())).expect_err("invalid");
    let AuthoringError::InvalidGltf { problems, .. } = &error else { panic!("{error:?}") };
    assert_eq!(problems.len(), 2, "{problems:?}");
    assert!(problems.iter().any(|problem| problem.starts_with("scene:")), "{problems:?}");
    assert!(problems.iter().any(|problem| problem.starts_with("nodes[2].mesh:")), "{problems:?}");
}

/// The folder of the desk model. Development data that does not travel with the repository: `None`, and why, without it.
fn desk_folder() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/ar_truth");
    let present = folder.join("desk.glb").is_file();
    if !present {
        eprintln!("skipped: there is no ../shared/data/ar_truth/desk.glb beside the repository");
    }
    present.then_some(folder)
}

/// What `desk.glb` says, node by node.
fn desk_components() -> Vec<(usize, &'static str, Vec<AuthoredComponent>)> {
    let phantom =
        |casts, receives| vec![AuthoredComponent::PhantomObject(PhantomObject { casts, receives, ..default() })];
    vec![
        (
            0,
            "marker",
            vec![
                AuthoredComponent::MarkerAnchor(MarkerAnchor::new(0, 0.1)),
                AuthoredComponent::WorldOrigin(WorldOrigin),
            ],
        ),
        (
            1,
            "ball",
            vec![AuthoredComponent::LightProbeSphere(LightProbeSphere {
                radius: 0.05,
                reflectance: 0.9,
                ..Default::default()
            })],
        ),
        (2, "table", phantom(false, true)),
        (3, "box", phantom(true, true)),
        (4, "can", phantom(true, true)),
        (5, "ball_proxy", phantom(true, false)),
    ]
}

#[test]
fn the_desk_model_holds_exactly_its_components() {
    let Some(folder) = desk_folder() else { return };
    let nodes = read_scene_components(&folder.join("desk.glb")).expect("a faultless model");
    assert_eq!(components_of(&nodes), desk_components());
    assert!(nodes.iter().all(|node| node.warnings.is_empty()));
}

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

/// Asserts that the node carries these of our components and no others.
fn assert_components(node: EntityRef, expected: &[AuthoredComponent]) {
    let mut found = Vec::new();
    found.extend(node.get().cloned().map(AuthoredComponent::LightProbeSphere));
    found.extend(node.get().cloned().map(AuthoredComponent::MarkerAnchor));
    found.extend(node.get().cloned().map(AuthoredComponent::PhantomObject));
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
    let Some(folder) = desk_folder() else { return };
    let mut app = spawn_scene(&folder, "desk.glb");
    for (_, name, expected) in desk_components() {
        assert_components(node(&mut app, name), &expected);
    }
    for name in ["v_matte", "v_metal", "v_block"] {
        assert_components(node(&mut app, name), &[]);
    }
    assert_eq!(*app.world().resource::<AuthoringReport>(), AuthoringReport::default());
}
