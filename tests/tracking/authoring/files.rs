//! Components read from files on disk, and errors in those files.

use super::{DESK_FOLDER, complete_set, desk_components, document, folder, glb, write};
use bevy::prelude::*;
use bevy_mirrorball::{
    authoring::{AuthoredComponent, AuthoringError, ExtrasProblem, NodeComponents, read_scene_components},
    materials::{SurfaceStyle, ToonStyle},
    phantom::PhantomObject,
    probe::LightProbeSphere,
    shadows::ShadowDomeLight,
    tracking::{MarkerAnchor, WorldOrigin},
};
use serde_json::json;
use std::path::Path;

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

#[test]
fn the_desk_model_holds_exactly_its_components() {
    let nodes = read_scene_components(&Path::new(DESK_FOLDER).join("desk.glb")).expect("a faultless model");
    assert_eq!(components_of(&nodes), desk_components());
    assert!(nodes.iter().all(|node| node.warnings.is_empty()));
}
