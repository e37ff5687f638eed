//! The example `track_marker`: its JSON, and its answers to bad input.

use crate::built_example;
use serde_json::Value;
use std::process::Output;

fn track(image: &str, more: &[&str]) -> Option<Output> {
    let arguments = [&["--image", image, "--intrinsics", "601.83,601.83,320,240"], more].concat();
    built_example::run("track_marker", &arguments)
}

fn markers(output: &Output) -> Vec<Value> {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).expect("nothing but JSON");
    said["markers"].as_array().expect("a list").clone()
}

#[test]
fn the_marker_of_the_shipped_desk_is_printed_with_corners_and_pose() {
    let Some(output) = track("assets/desk_clip/frame_000.jpg", &["--size", "0.1", "--json"]) else { return };
    let [marker] = &markers(&output)[..] else { panic!("one marker") };
    assert_eq!(marker["id"], 0);
    let corner = |i: usize, axis: usize| marker["corners"][i][axis].as_f64().expect("a number");
    let pose: Vec<f64> =
        marker["camera_from_marker"].as_array().expect("a list").iter().flat_map(Value::as_f64).collect();
    assert_eq!(pose.len(), 16);
    // The first corner is the bottom left one: half a side to the left and to the bottom edge, in columns.
    let seen = [0, 1, 2].map(|axis| -0.05 * pose[axis] + 0.05 * pose[8 + axis] + pose[12 + axis]);
    let [x, y] = [320.0 - 601.83 * seen[0] / seen[2], 240.0 + 601.83 * seen[1] / seen[2]];
    let off = (x - corner(0, 0)).hypot(y - corner(0, 1));
    assert!(off < 0.3, "the first corner is {off} px from where the pose has it");
}

#[test]
fn nothing_found_is_an_empty_list_and_no_file_an_error() {
    let Some(output) = track("assets/desk_clip/frame_000.jpg", &["--family", "tag25h9", "--json"]) else { return };
    assert!(markers(&output).is_empty());
    let Some(output) = track("assets/no_such_picture.png", &["--json"]) else { return };
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0));
    assert!(String::from_utf8_lossy(&output.stderr).contains("no_such_picture.png"));
}
