//! Components read from files on disk, and errors in those files.

use super::{DESK_FOLDER, complete_set, desk_components, document, folder, glb, write};
use bevy::prelude::*;
use bevy_mirrorball::{
    authoring::{AuthoredComponent, AuthoringError, ExtrasPlace, ExtrasProblem, NodeComponents, read_scene_components},
    materials::{SurfaceStyle, ToonStyle},
    phantom::PhantomObject,
    probe::{ClipEvidence, ClipRecovery, LightProbeSphere},
    shadows::ShadowDomeLight,
    tracking::{FilterUse, MarkerAnchor, MarkerBoard, PoseFilter, WorldOrigin},
};
use serde_json::{Value, json};
use std::{path::Path, time::Duration};

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
        (
            7,
            "sheet",
            vec![
                AuthoredComponent::MarkerAnchor(MarkerAnchor::new(20, 0.05)),
                AuthoredComponent::MarkerBoard(MarkerBoard::grid(&MarkerAnchor::new(20, 0.05), 2, 2, 0.07)),
                AuthoredComponent::PoseFilter(PoseFilter {
                    filter: FilterUse::Always,
                    lost_after: Duration::from_millis(250),
                    predict: true,
                    ..default()
                }),
            ],
        ),
        (
            8,
            "small ball",
            vec![
                AuthoredComponent::ClipRecovery(ClipRecovery {
                    paper_reflectance: 0.7,
                    evidence: ClipEvidence::Paper,
                    ..default()
                }),
                AuthoredComponent::LightProbeSphere(LightProbeSphere { radius: 0.02, ..default() }),
            ],
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

/// A set whose desk has its component on the mesh, which the shelf uses too, and which has others on its scene.
fn set_with_extras_elsewhere() -> Value {
    let mut set = document(json!([
        {"name": "desk", "mesh": 0},
        {"name": "shelf", "mesh": 0, "extras": {"PhantomObject": {"receives": false}}},
    ]));
    set["meshes"] = json!([{
        "name": "board",
        "extras": {"PhantomObject": {"casts": false}, "phantomobject": 1},
        "primitives": [{"attributes": {"POSITION": 0}, "material": 0}],
    }]);
    let corner = json!([0.0, 0.0, 0.0]);
    set["accessors"] = json!([
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": corner, "max": corner},
    ]);
    set["bufferViews"] = json!([{"buffer": 0, "byteLength": 36}]);
    set["buffers"] = json!([{"byteLength": 36, "uri": "not_read.bin"}]);
    set["materials"] = json!([{"name": "wood", "extras": {"PhantomObject": {}}}]);
    set["scenes"][0]["name"] = json!("Room");
    set["scenes"][0]["extras"] = json!({"ShadowDomeLight": {"directions": 16}, "LightProbeSphere": {}});
    set
}

#[test]
fn components_on_meshes_and_scenes_are_taken_or_named() {
    let path = write("elsewhere.glb", &glb(&set_with_extras_elsewhere()));
    let nodes = read_scene_components(&path).expect("no mistake");
    let phantom =
        |casts, receives| vec![AuthoredComponent::PhantomObject(PhantomObject { casts, receives, ..default() })];
    let dome = AuthoredComponent::ShadowDomeLight(ShadowDomeLight { directions: 16, ..default() });
    let expected = vec![
        (0, "desk", phantom(false, true)),
        (1, "shelf", phantom(true, false)),
        (0, "board", vec![]),
        (0, "Room", vec![dome]),
        (0, "wood", vec![]),
    ];
    assert_eq!(components_of(&nodes), expected);
    let warnings: Vec<_> =
        nodes.iter().flat_map(|n| &n.warnings).map(|w| (w.context.place, &*w.context.node, &*w.key)).collect();
    let expected = [
        (ExtrasPlace::Mesh, "board", "phantomobject"),
        (ExtrasPlace::Scene, "Room", "LightProbeSphere"),
        (ExtrasPlace::Material, "wood", "PhantomObject"),
    ];
    assert_eq!(warnings, expected);
}

#[test]
fn a_mistake_on_a_mesh_names_the_mesh() {
    let mut set = set_with_extras_elsewhere();
    set["meshes"][0]["extras"] = json!({"PhantomObject": {"casts": 1}});
    let error = read_scene_components(&write("mesh_mistake.glb", &glb(&set))).expect_err("a mistake").to_string();
    assert!(error.contains("mesh \"board\": PhantomObject.casts is 1"), "{error}");
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

#[test]
fn a_mesh_without_its_accessors_is_invalid_and_no_panic() {
    let mut set = set_with_extras_elsewhere();
    set["accessors"] = json!([]);
    let error = read_scene_components(&write("no_accessors.glb", &glb(&set))).expect_err("invalid");
    assert!(matches!(error, AuthoringError::InvalidGltf { .. }), "{error:?}");
}

#[test]
fn the_desk_model_holds_exactly_its_components() {
    let nodes = read_scene_components(&Path::new(DESK_FOLDER).join("desk.glb")).expect("a faultless model");
    assert_eq!(components_of(&nodes), desk_components());
    assert!(nodes.iter().all(|node| node.warnings.is_empty()));
}
