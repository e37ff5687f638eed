//! Facts of `assets/models/dancer.glb` that the dance game counts on: its clips, their beats, and where the feet are.
//!
//! The clips' time is in beats, lengths are in meters. Joints are posed as glTF 2.0 defines it (Khronos Group, 2021).

use bevy::math::{Mat4, Quat, Vec3};
use gltf::{
    Gltf,
    animation::util::ReadOutputs,
    mesh::util::{ReadIndices, ReadJoints, ReadWeights},
};
use std::{collections::HashMap, path::Path};

/// Name, length in beats, and which feet land when.
const CLIPS: [(&str, f32, &[(&str, f32)]); 9] = [
    ("idle", 2.0, &[]),
    ("step_left", 1.0, &[("left", 0.5)]),
    ("step_down", 1.0, &[("left", 0.5)]),
    ("step_up", 1.0, &[("right", 0.5)]),
    ("step_right", 1.0, &[("right", 0.5)]),
    ("jump", 1.0, &[("left", 0.5), ("right", 0.5)]),
    ("spin", 2.0, &[("right", 1.5)]),
    ("cheer", 2.0, &[]),
    ("stumble", 1.0, &[("right", 0.5)]),
];
/// Where a foot lands, right and up and toward +Z of where it stands at rest.
const LANDINGS: [(&str, &str, Vec3); 4] = [
    ("step_left", "left", Vec3::new(-0.016, 0.0, 0.0)),
    ("step_right", "right", Vec3::new(0.016, 0.0, 0.0)),
    ("step_up", "right", Vec3::new(0.0, 0.0, -0.021)),
    ("step_down", "left", Vec3::new(-0.003, 0.0, 0.021)),
];
/// Of 32-bit numbers that were rounded to seven digits.
const ROUNDING: f32 = 1e-5;
/// A foot counts as on the ground up to this height.
const CONTACT_HEIGHT: f32 = 0.0004;
/// No later than this before it lands, a foot is in the air.
const LANDING_BEATS: f32 = 0.03;

/// Keys of one joint in a clip.
#[derive(Default)]
struct Track {
    translations: Vec<Vec3>,
    rotations: Vec<Quat>,
}

struct Clip {
    times: Vec<f32>,
    tracks: HashMap<usize, Track>,
}

struct Vertex {
    position: Vec3,
    joints: [u16; 4],
    weights: [f32; 4],
}

struct Dancer {
    file: Gltf,
    /// Node of each joint, and its inverse bind matrix.
    joints: Vec<(usize, Mat4)>,
    vertices: Vec<Vertex>,
    triangles: usize,
}

impl Dancer {
    fn load() -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models/dancer.glb");
        let bytes = std::fs::read(path).expect("scripts/make_dancer.py wrote the file");
        let file = Gltf::from_slice(&bytes).expect("the file is binary glTF");
        let blob = file.blob.as_deref().expect("the file has a binary chunk");
        let (mut vertices, mut triangles) = (Vec::new(), 0);
        for primitive in file.meshes().flat_map(|mesh| mesh.primitives()) {
            let reader = primitive.reader(|_| Some(blob));
            let positions = reader.read_positions().expect("positions");
            let Some(ReadJoints::U8(joints)) = reader.read_joints(0) else { panic!("joints are bytes") };
            let Some(ReadWeights::F32(weights)) = reader.read_weights(0) else { panic!("weights are floats") };
            let start = vertices.len();
            vertices.extend(positions.zip(joints).zip(weights).map(|((position, joints), weights)| Vertex {
                position: Vec3::from(position),
                joints: joints.map(u16::from),
                weights,
            }));
            let Some(ReadIndices::U16(indices)) = reader.read_indices() else { panic!("indices are 16 bits") };
            triangles += indices.len() / 3;
            let count = vertices.len() - start;
            assert!(reader.read_indices().is_some_and(|indices| indices.into_u32().all(|i| (i as usize) < count)));
        }
        let skin = file.skins().next().expect("a skin");
        let matrices = skin.reader(|_| Some(blob)).read_inverse_bind_matrices().expect("inverse bind matrices");
        let matrices = matrices.map(|columns| Mat4::from_cols_array_2d(&columns));
        let joints = skin.joints().map(|joint| joint.index()).zip(matrices).collect();
        Self { joints, vertices, triangles, file }
    }

    fn clip(&self, name: &str) -> Clip {
        let blob = self.file.blob.as_deref().expect("the file has a binary chunk");
        let animation = self.file.animations().find(|a| a.name() == Some(name)).expect(name);
        let mut clip = Clip { times: Vec::new(), tracks: HashMap::new() };
        for channel in animation.channels() {
            let reader = channel.reader(|_| Some(blob));
            clip.times = reader.read_inputs().expect("times").collect();
            let track = clip.tracks.entry(channel.target().node().index()).or_default();
            match reader.read_outputs().expect("keys") {
                ReadOutputs::Translations(keys) => track.translations = keys.map(Vec3::from).collect(),
                ReadOutputs::Rotations(keys) => track.rotations = keys.into_f32().map(Quat::from_array).collect(),
                _ => panic!("a channel of {name} scales or morphs"),
            }
        }
        clip
    }

    /// Matrices that take vertices of the modeled pose to a clip's pose, by joint.
    fn pose(&self, clip: &Clip, time: f32) -> Vec<Mat4> {
        let last = clip.times.len() - 2;
        let key = clip.times.iter().rposition(|key| *key <= time).unwrap_or(0).min(last);
        let fraction = (time - clip.times[key]) / (clip.times[key + 1] - clip.times[key]);
        let mut globals = HashMap::new();
        let roots = self.file.scenes().flat_map(|scene| scene.nodes()).map(|node| (node, Mat4::IDENTITY));
        let mut open: Vec<_> = roots.collect();
        while let Some((node, parent)) = open.pop() {
            let (translation, rotation, scale) = node.transform().decomposed();
            let (mut translation, mut rotation) = (Vec3::from(translation), Quat::from_array(rotation));
            if let Some(track) = clip.tracks.get(&node.index()) {
                if let [from, to] = track.translations.get(key..key + 2).unwrap_or(&[]) {
                    translation = from.lerp(*to, fraction);
                }
                if let [from, to] = track.rotations.get(key..key + 2).unwrap_or(&[]) {
                    rotation = from.slerp(*to, fraction);
                }
            }
            let global = parent * Mat4::from_scale_rotation_translation(Vec3::from(scale), rotation, translation);
            globals.insert(node.index(), global);
            open.extend(node.children().map(|child| (child, global)));
        }
        self.joints.iter().map(|(node, inverse_bind)| globals[node] * *inverse_bind).collect()
    }

    fn joint(&self, name: &str) -> usize {
        let has_name = |(node, _): &(usize, Mat4)| self.file.nodes().nth(*node).is_some_and(|n| n.name() == Some(name));
        self.joints.iter().position(has_name).expect(name)
    }

    /// Height of the lowest vertex of a foot, and the mean of the vertices at its toes.
    fn foot(&self, side: &str, pose: &[Mat4]) -> (f32, Vec3) {
        let [foot, toes] = ["foot", "toes"].map(|name| self.joint(&format!("{name}_{side}")) as u16);
        let (mut low, mut sum, mut count) = (f32::MAX, Vec3::ZERO, 0.0);
        for vertex in self.vertices.iter().filter(|v| v.joints[0] == foot || v.joints[0] == toes) {
            let position = skinned(vertex, pose);
            low = low.min(position.y);
            if vertex.joints[0] == toes {
                sum += position;
                count += 1.0;
            }
        }
        (low, sum / count)
    }
}

fn skinned(vertex: &Vertex, pose: &[Mat4]) -> Vec3 {
    let terms = vertex.joints.iter().zip(vertex.weights);
    terms.map(|(joint, weight)| weight * pose[usize::from(*joint)].transform_point3(vertex.position)).sum()
}

#[test]
fn the_dancer_has_every_clip_in_beats() {
    let dancer = Dancer::load();
    let names: Vec<_> = dancer.file.animations().filter_map(|a| a.name().map(String::from)).collect();
    assert_eq!(names, CLIPS.map(|(name, ..)| name));
    for (name, beats, _) in CLIPS {
        let clip = dancer.clip(name);
        assert_eq!((clip.times.first(), clip.times.last()), (Some(&0.0), Some(&beats)), "{name}");
        // A joint without keys would keep what the clip before left.
        assert_eq!(clip.tracks.len(), dancer.joints.len(), "{name} moves every joint");
    }
}

#[test]
fn every_clip_ends_as_it_begins_and_all_but_the_ponytail_begin_alike() {
    let dancer = Dancer::load();
    let hair = ["ponytail", "ponytail_tip"].map(|name| dancer.joints[dancer.joint(name)].0);
    let idle = dancer.clip("idle");
    for (name, ..) in CLIPS {
        for (node, track) in dancer.clip(name).tracks {
            // A rotation and its negative are the same.
            let (first, last) = (track.rotations[0], track.rotations[track.rotations.len() - 1]);
            assert!(first.dot(last).abs() > 1.0 - ROUNDING, "{name}: joint {node} ends turned");
            assert!(track.rotations.iter().all(|rotation| rotation.is_normalized()));
            let rest = idle.tracks[&node].rotations[0];
            assert!(
                hair.contains(&node) || first.dot(rest).abs() > 1.0 - ROUNDING,
                "{name}: joint {node} begins turned"
            );
            if let (Some(first), Some(last)) = (track.translations.first(), track.translations.last()) {
                assert!(first.distance(*last) < ROUNDING, "{name}: joint {node} ends elsewhere");
            }
        }
    }
}

#[test]
fn feet_land_on_the_beat_and_never_sink() {
    let dancer = Dancer::load();
    for (name, beats, landings) in CLIPS {
        let clip = dancer.clip(name);
        for (side, landing) in landings {
            let height = |time: f32| dancer.foot(side, &dancer.pose(&clip, time)).0;
            assert!(height(landing - LANDING_BEATS) > CONTACT_HEIGHT, "{name}: {side} foot lands early");
            for late in [0.0, 0.05, 0.1, 0.15] {
                assert!(
                    height(landing + late) < CONTACT_HEIGHT,
                    "{name}: {side} foot is up {late} beats after landing"
                );
            }
        }
        for step in 0..=(48.0 * beats) as u32 {
            let pose = dancer.pose(&clip, step as f32 / 48.0);
            let low = ["left", "right"].map(|side| dancer.foot(side, &pose).0);
            assert!(low.iter().all(|height| *height > -0.0005), "{name}: a foot is {low:?} m high at {step}/48");
        }
    }
}

#[test]
fn each_step_lands_in_its_direction() {
    let dancer = Dancer::load();
    for (name, side, expected) in LANDINGS {
        let clip = dancer.clip(name);
        let at = |time: f32| dancer.foot(side, &dancer.pose(&clip, time)).1;
        let moved = at(0.55) - at(0.0);
        // Toes of a raised heel lie flat, but their skin stretches.
        assert!((moved - expected).length() < 0.002, "{name}: {side} foot moves by {moved}, not by {expected}");
    }
}

#[test]
fn the_dancer_is_15_cm_tall_and_light_enough_for_a_web_page() {
    let dancer = Dancer::load();
    assert!((6_000..=20_000).contains(&dancer.triangles), "{} triangles", dancer.triangles);
    for vertex in &dancer.vertices {
        assert!((vertex.weights.iter().sum::<f32>() - 1.0).abs() < ROUNDING);
        assert!(vertex.joints.iter().all(|joint| usize::from(*joint) < dancer.joints.len()));
    }
    let pose = dancer.pose(&dancer.clip("idle"), 0.0);
    let heights = dancer.vertices.iter().map(|vertex| skinned(vertex, &pose).y);
    let (low, high) = heights.fold((f32::MAX, f32::MIN), |(low, high), y| (low.min(y), high.max(y)));
    assert!(low.abs() < 0.0005 && (high - 0.15).abs() < 0.005, "she is {low} to {high} m high");
}
