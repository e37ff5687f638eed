//! The example `dance_stage` without a camera: what it draws of its places, and the facts of their files.

use crate::built_example::{self, scratch};
use bevy::{
    color::{Color, ColorToComponents},
    math::{UVec2, Vec3},
};
use bevy_mirrorball::camera::FramePixels;
use serde_json::Value;
use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

/// Small, because software Vulkan is slow.
const SIZE: UVec2 = UVec2::new(96, 72);
/// Frames of a dance at 15 a second, in which arrows are stepped on, and of pictures to compare.
const FRAMES: u32 = 60;
const FEW: u32 = 2;
/// Largest file of a scene, in bytes.
const MAX_BYTES: u64 = 2_000_000;
/// Where the dancer is in the picture, from the upper left to the lower right corner.
const DANCER: [UVec2; 2] = [UVec2::new(42, 40), UVec2::new(56, 64)];
/// White tiles of the campus in the picture.
const TILES: [UVec2; 2] = [UVec2::new(40, 62), UVec2::new(56, 66)];
/// Parts of messages that a user would take for trouble.
const TROUBLE: [&str; 4] = ["WARN", "ERROR", "panicked", "alidation"];

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes").join(name)
}

/// Draws a place twice, and compares what was seen and reached.
fn dances_in(place: &str) {
    let mut results = Vec::new();
    for run in ["first", "second"] {
        let out = scratch(&format!("dance_in_{place}_{run}"));
        let _ = std::fs::remove_dir_all(&out);
        let result = out.with_extension("json");
        let (count, size) = (FRAMES.to_string(), format!("{}x{}", SIZE.x, SIZE.y));
        let [folder, file] = [&out, &result].map(|path| path.to_string_lossy().into_owned());
        let arguments = ["--place", place, "--headless", "--demo", "--frames", &count, "--size", &size];
        let outputs = ["--out", &folder, "--result", &file];
        let Some(output) = built_example::run("dance_stage", &[&arguments[..], &outputs].concat()) else { return };
        let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{place}: {said}");
        assert!(!TROUBLE.iter().any(|word| said.contains(word)), "{place}: {said}");
        looks_alive(place, &out);
        results.push(std::fs::read_to_string(&result).expect("written"));
    }
    assert_eq!(results[0], results[1], "{place}: the same seed");
    let result: Value = serde_json::from_str(&results[0]).expect("is JSON");
    let player = &result["players"][0];
    assert_eq!(player["dropped"], 0, "{place}: {result}");
    assert!(player["judged"].as_u64() > Some(0), "{place}: {result}");
}

/// Pictures are colorful, shadows of natural things are not black, and the dancer moves.
fn looks_alive(place: &str, out: &Path) {
    let picture = |i: u32| FramePixels::open(out.join(format!("frame_{i:04}.png"))).expect("written");
    let (first, last) = (picture(0), picture(FRAMES - 1));
    assert_eq!(first.size, SIZE, "{place}");
    let colors: BTreeSet<[u8; 3]> = first.rgba.chunks_exact(4).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    assert!(colors.len() > 500, "{place}: {} colors", colors.len());
    let black = first.rgba.chunks_exact(4).filter(|pixel| pixel[..3].iter().all(|value| *value < 4)).count();
    // Toons have black outlines.
    assert!(place == "campus" || black < (SIZE.element_product() / 50) as usize, "{place}: {black} black pixels");
    let [from, to] = DANCER.map(UVec2::as_ivec2);
    let moved = (from.y..to.y).flat_map(|y| (from.x..to.x).map(move |x| (x, y)));
    let moved = moved.filter(|(x, y)| first.rgb8(*x, *y) != last.rgb8(*x, *y)).count();
    assert!(moved > 20, "{place}: {moved} pixels of the dancer differ");
}

#[test]
fn the_dancer_dances_at_stonehenge() {
    dances_in("stonehenge");
}

#[test]
fn the_dancer_dances_on_the_campus() {
    dances_in("campus");
}

/// Mean color of white tiles of the campus, in the middle of its court, in linear light.
fn color_of_tiles(arguments: &[&str]) -> Option<Vec3> {
    let out = scratch(&format!("tiles_{}", arguments.len()));
    let _ = std::fs::remove_dir_all(&out);
    let (count, folder) = (FEW.to_string(), out.to_string_lossy().into_owned());
    let size = format!("{}x{}", SIZE.x, SIZE.y);
    let outputs = ["--headless", "--frames", &count, "--size", &size, "--out", &folder];
    let output = built_example::run("dance_stage", &[arguments, &outputs].concat())?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && !TROUBLE.iter().any(|word| said.contains(word)), "{said}");
    let picture = FramePixels::open(out.join(format!("frame_{:04}.png", FEW - 1))).expect("written");
    let [from, to] = TILES.map(UVec2::as_ivec2);
    let pixels = (from.y..to.y).flat_map(|y| (from.x..to.x).map(move |x| (x, y)));
    let linear = pixels.map(|(x, y)| {
        let [red, green, blue] = picture.rgb8(x, y);
        Color::srgb_u8(red, green, blue).to_linear().to_vec3()
    });
    Some(linear.sum::<Vec3>() / (to - from).element_product() as f32)
}

#[test]
fn the_room_of_a_feed_lights_a_place_in_its_colors() {
    let clip = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/desk_clip");
    let feed = format!("clip:{}", clip.display());
    let Some(by_day) = color_of_tiles(&["--place", "campus"]) else { return };
    let Some(in_room) = color_of_tiles(&["--place", "campus", "--feed", &feed]) else { return };
    // The recorded room has warm lamps: its desk is three times as red as blue, the sky of the campus is not.
    let warmth = |color: Vec3| color.x / color.z;
    assert!((0.7..1.2).contains(&warmth(by_day)), "{by_day}");
    assert!(warmth(in_room) > 1.25 * warmth(by_day) && in_room.min_element() > 0.05, "{in_room} and {by_day}");
}

#[test]
fn without_a_camera_nothing_of_a_camera_is_accepted() {
    let cases: [(&[&str], &[&str]); 5] = [
        (&["--solo", "--fov", "60"], &["without a camera", "--fov"]),
        (&["--place", "campus", "--mat", "297"], &["--mat", "add --feed"]),
        (&["--feed", "image:a.jpg", "--scene", "a.glb", "--solo"], &["instead of a place", "--scene"]),
        (&["--solo", "--set", "a.glb"], &["leave out --set"]),
        (&["--place", "moon"], &["stonehenge or campus", "moon"]),
    ];
    for (arguments, expected) in cases {
        let Some(output) = built_example::run("dance_stage", &[arguments, &["--headless"]].concat()) else { return };
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{arguments:?}");
        assert!(expected.iter().all(|part| said.contains(part)), "{arguments:?}: {said}");
    }
}

/// Vertices that are drawn: those of shared meshes count for each node.
fn drawn_vertices(file: &gltf::Gltf) -> usize {
    let meshes = file.nodes().filter_map(|node| node.mesh());
    let positions = |primitive: gltf::Primitive| primitive.get(&gltf::Semantic::Positions).map(|data| data.count());
    meshes.flat_map(|mesh| mesh.primitives().filter_map(positions).collect::<Vec<_>>()).sum()
}

#[test]
fn scenes_are_rich_and_their_files_small() {
    for (name, fewest) in [("stonehenge.glb", 60_000), ("campus.glb", 8_000)] {
        let path = scene(name);
        let bytes = std::fs::metadata(&path).expect("a file of the repository").len();
        assert!(bytes <= MAX_BYTES, "{name}: {bytes} bytes");
        let file = gltf::Gltf::open(&path).expect("a glTF file");
        let vertices = drawn_vertices(&file);
        assert!(vertices >= fewest, "{name}: {vertices} vertices");
        let cameras: Vec<_> = file.nodes().filter(|node| node.camera().is_some()).collect();
        let names: Vec<_> = cameras.iter().filter_map(|node| node.name()).collect();
        assert_eq!(names, ["camera_wide", "camera_close"], "{name}");
        assert!(file.nodes().any(|node| node.name() == Some("sun")), "{name}");
    }
    let sky = std::fs::metadata(scene("stonehenge_sky.hdr")).expect("a file of the repository").len();
    assert!(sky <= MAX_BYTES, "{sky} bytes");
}

#[test]
fn stonehenge_has_one_spot_light() {
    let file = std::fs::read(scene("stonehenge.glb")).expect("a file of the repository");
    let file = gltf::binary::Glb::from_slice(&file).expect("a binary glTF file");
    let json: Value = serde_json::from_slice(&file.json).expect("is JSON");
    let lights = json["extensions"]["KHR_lights_punctual"]["lights"].as_array().expect("has lights");
    let said: Vec<_> = lights.iter().map(|light| (&light["name"], &light["type"])).collect();
    assert_eq!(said, [(&Value::from("moody spot"), &Value::from("spot"))]);
}
