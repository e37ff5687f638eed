//! Authored glTF files become components: read from disk, and spawned by Bevy's own loader without a GPU.

mod files;
mod spawned;

use bevy::prelude::*;
use bevy_mirrorball::{
    authoring::AuthoredComponent,
    phantom::PhantomObject,
    probe::LightProbeSphere,
    shadows::ShadowDomeLight,
    tracking::{MarkerAnchor, WorldOrigin},
};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

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
        {"name": "sheet", "extras": {
            "MarkerAnchor": {"id": 20, "size": 0.05},
            "MarkerBoard": {"grid": {"columns": 2, "rows": 2, "spacing": 0.07}},
            "PoseFilter": {"filter": "Always", "lost_after": 0.25, "predict": true},
        }},
        {"name": "small ball", "extras": {
            "LightProbeSphere": {"radius": 0.02},
            "ClipRecovery": {"paper_reflectance": 0.7, "evidence": "Paper"},
        }},
    ]))
}

/// The model of the desk that is shipped.
const DESK_FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/desk");

/// What its nodes say, one by one.
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
        (2, "dome", vec![AuthoredComponent::ShadowDomeLight(ShadowDomeLight { directions: 64, ..default() })]),
        (3, "desk", phantom(false, true)),
        (4, "real ball", phantom(true, false)),
        (5, "real box", phantom(true, true)),
        (6, "real can", phantom(true, true)),
    ]
}
