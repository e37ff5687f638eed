//! The example `dance_stage` without a window: two loops of the shipped clip, and its answers to bad input.

use crate::built_example;
use crate::built_example::scratch;
use bevy::math::UVec2;
use bevy_mirrorball::camera::FramePixels;
use serde_json::Value;

/// Pictures in the shipped clip.
const CLIP: usize = 60;
/// Small, because software Vulkan is slow.
const SIZE: UVec2 = UVec2::new(96, 72);
/// Memory that the second loop may need beyond the first, in MiB. What leaks does so with every picture, so it shows
/// both from end to end and in the sum of small steps from picture to picture; each of these alone also has the buffers
/// of software Vulkan in it that come and go within a frame, and are seen or not as the machine is busy.
const LEAK_MIB: f64 = 16.0;
/// A larger step is such a buffer.
const DRIVER_STEP_MIB: f64 = 5.0;
/// From end to end in any case: several of those buffers.
const GROWTH_MIB: f64 = 250.0;
/// Parts of messages that a user would take for trouble.
const TROUBLE: [&str; 4] = ["WARN", "ERROR", "panicked", "alidation"];

#[cfg(target_os = "linux")]
#[test]
fn two_loops_of_the_clip_are_drawn_without_trouble_or_growing_memory() {
    let out = scratch("dance_stage");
    let _ = std::fs::remove_dir_all(&out);
    let (frames, size) = ((2 * CLIP).to_string(), format!("{}x{}", SIZE.x, SIZE.y));
    let folder = out.to_str().expect("the target folder has a printable name");
    let Some(output) = built_example::run("dance_stage", &["--frames", &frames, "--size", &size, "--out", folder])
    else {
        return;
    };
    let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}");
    assert!(said.contains("no display"), "the change to files has to be said: {said}");
    assert!(!TROUBLE.iter().any(|word| said.contains(word)), "{said}");

    let report = std::fs::read_to_string(out.join("report.json")).expect("written");
    let report: Value = serde_json::from_str(&report).expect("is JSON");
    let lines = report["frames"].as_array().expect("a line for each picture");
    assert_eq!(lines.len(), 2 * CLIP);
    let first = lines[0]["picture"].as_u64().expect("counted");
    for (i, line) in lines.iter().enumerate() {
        assert_eq!(line["marker"], "Tracked", "picture {i}");
        assert_eq!(line["ball_in_view"], true, "picture {i}");
        assert_eq!(line["picture"], first + i as u64, "every picture once");
    }
    let memory: Vec<f64> = lines.iter().map(|line| line["memory_mib"].as_f64().expect("Linux tells")).collect();
    let growth = memory[2 * CLIP - 1] - memory[CLIP - 1];
    let steps = memory[CLIP - 1..].windows(2).map(|pair| pair[1] - pair[0]);
    let creep: f64 = steps.filter(|step| step.abs() < DRIVER_STEP_MIB).sum();
    println!(
        "memory: {:.1} MiB after one loop, {growth:+.1} MiB in the second, {creep:+.1} of it in small steps",
        memory[CLIP - 1]
    );
    let leak = creep.min(growth);
    assert!(leak <= LEAK_MIB && growth <= GROWTH_MIB, "{creep} and {growth} MiB more in the second loop");

    let picture = |i: usize| FramePixels::open(out.join(format!("frame_{i:04}.png"))).expect("written");
    assert_eq!(picture(0).size, SIZE);
    let differences = |a: &FramePixels, b: &FramePixels| a.rgba.iter().zip(&b.rgba).filter(|(a, b)| a != b).count();
    assert!(differences(&picture(0), &picture(7)) > 1000, "camera and dancer move");
    // What the camera sees repeats itself; where the show is not, the second loop equals the first.
    let (one, two) = (picture(3), picture(3 + CLIP));
    assert!((0..SIZE.x as i32).all(|x| one.rgb8(x, 0).iter().zip(two.rgb8(x, 0)).all(|(a, b)| a.abs_diff(b) <= 1)));
    let sheet = FramePixels::open(out.join("contact_sheet.png")).expect("written");
    assert_eq!(sheet.size, UVec2::new(10 * 160, 12 * 120));
}

/// Pictures of a demo, in which two arrows are due with the first of them at the latest.
const DEMO: usize = 20;

#[test]
fn a_demo_shows_arrows_and_two_runs_reach_the_same() {
    let mut results = Vec::new();
    for (name, players) in [("dance_demo_a", "2"), ("dance_demo_b", "2"), ("dance_demo_alone", "1")] {
        let (out, result) = (scratch(name), scratch(&format!("{name}.json")));
        let (folder, result) = (out.to_string_lossy(), result.to_string_lossy().into_owned());
        let (frames, size) = (DEMO.to_string(), format!("{}x{}", SIZE.x, SIZE.y));
        let arguments =
            ["--headless", "--demo", "--players", players, "--frames", &frames, "--size", &size, "--out", &folder];
        let Some(output) = built_example::run("dance_stage", &[&arguments[..], &["--result", &result]].concat()) else {
            return;
        };
        let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success() && !TROUBLE.iter().any(|word| said.contains(word)), "{said}");
        results.push(std::fs::read_to_string(result).expect("written"));
        // Red arrows of quarters rise in the lanes on the left; nothing on the desk there is that red.
        let red = |i: usize| {
            let picture = FramePixels::open(out.join(format!("frame_{i:04}.png"))).expect("written");
            let lanes = (0..SIZE.y as i32).flat_map(|y| (0..SIZE.x as i32 / 3).map(move |x| (x, y)));
            lanes.map(|(x, y)| picture.rgb8(x, y)).filter(|[r, g, b]| *r > 200 && *g < 110 && *b < 110).count()
        };
        let reds = [red(6), red(DEMO - 1)];
        println!("{name}: {reds:?} red pixels");
        assert!(reds.iter().all(|count| *count > 3), "{reds:?}");
    }
    assert_eq!(results[0], results[1]);
    let result: Value = serde_json::from_str(&results[0]).expect("is JSON");
    let players = result["players"].as_array().expect("a line for each player");
    assert_eq!(players.len(), 2);
    for player in players {
        assert_eq!((&player["dropped"], &player["hits"]["miss"]), (&Value::from(0), &Value::from(0)));
        assert!(player["judged"].as_u64() >= Some(1), "the first arrow falls: {player}");
    }
}

#[test]
fn bad_input_is_answered_with_what_to_do() {
    let wide = scratch("wide_calibration.json");
    let intrinsics =
        r#"{"image": [1280, 720], "intrinsics": {"fx": 900, "fy": 900, "cx": 640, "cy": 360, "k1": -0.1}}"#;
    std::fs::write(&wide, intrinsics).expect("written");
    let wide = wide.to_string_lossy();
    let cases: [(&[&str], &[&str]); 19] = [
        (&["--calibration", "nowhere.yml"], &["nowhere.yml"]),
        (&["--calibration", &wide], &["--calibration", "1280 × 720", "640 × 480"]),
        (&["--feed", "tape:1"], &["clip:DIR", "tape:1"]),
        (&["--feed", "clip:nowhere"], &["nowhere/clip.json", "sidecar"]),
        (&["--feed", "image:nowhere.jpg"], &["nowhere.jpg"]),
        (&["--intrinsics", "1,2,3"], &["FX,FY,CX,CY"]),
        (&["--fov", "0"], &["degrees"]),
        (&["--toon", "dancer,roof"], &["roof", "mirror ball"]),
        (&["--frames", "0"], &["--frames", "above 0"]),
        (&["--size", "640"], &["WIDTHxHEIGHT", "640"]),
        (&["--scene", "nothing.glb"], &["nothing.glb"]),
        (&["--set", "nothing.glb"], &["nothing.glb"]),
        (&["--set", "a.glb", "--scene", "b.glb"], &["--set", "--scene"]),
        (&["--song", "nothing.sm"], &["nothing.sm"]),
        (&["--music", "nothing.ogg"], &["nothing.ogg"]),
        (&["--dancer", "nothing.glb"], &["nothing.glb"]),
        (&["--difficulty", "mad"], &["mad", "easy, medium or hard"]),
        (&["--players", "3"], &["--players", "1 or 2"]),
        (&["--result", "result.json"], &["--result", "--demo"]),
    ];
    for (arguments, expected) in cases {
        let Some(output) = built_example::run("dance_stage", &[arguments, &["--headless"]].concat()) else { return };
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{arguments:?}");
        assert!(expected.iter().all(|part| said.contains(part)), "{arguments:?}: {said}");
    }
}
