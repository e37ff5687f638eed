//! What has no place in the sources that browsers run: clocks that panic there, threads, waiting. Compiling for the web
//! (`scripts/check_web.sh`) does not find most of it, because the standard library has it everywhere and fails at run
//! time.

use crate::sources;

/// Folders and files that are not compiled for the web, by the start of their paths.
const NATIVE: [&str; 5] = [
    "src/camera/webcam/",
    "src/headless/",
    "src/debug/panel/",
    "src/tracking/apriltag.rs",
    "src/tracking/apriltag_family.rs",
];

/// What a browser has not, and what to use instead.
const ABSENT: [(&str, &str); 10] = [
    ("Instant", "`bevy::platform::time::Instant`, which is that of the standard library elsewhere"),
    ("SystemTime", "the times of frames, or `bevy::platform::time`"),
    ("thread", "a task of `AsyncComputeTaskPool`"),
    ("fs", "assets, or images that the game passes; where the user names a file, an error"),
    ("process", "a Cargo feature that the web leaves out"),
    ("net", "a Cargo feature that the web leaves out"),
    ("block_on(", "`check_ready` in the next update"),
    (".recv(", "`try_recv` in the next update"),
    (".recv_timeout(", "`try_recv` in the next update"),
    ("PollType::Wait", "a callback"),
];

/// Where it is harmless, and why: file, what it uses, reason.
const ALLOWED: &[(&str, &str, &str)] = &[
    ("src/authoring/scene_file.rs", "fs", "for tools; returns the error"),
    ("src/camera/calibration/lens_file.rs", "fs", "returns the error; `parse` is the way on the web"),
    ("src/camera/calibration/solve.rs", "fs", "returns the error"),
    ("src/camera/clip.rs", "fs", "returns the error, and the feed says so"),
    ("src/camera/image_file.rs", "fs", "returns the error, and the feed says so"),
    ("src/environment_map/files.rs", "fs", "returns the error"),
    ("src/image_files/mod.rs", "fs", "returns the error"),
    ("src/tracking/recording.rs", "fs", "`FrameRecorder::error` says that there are no folders"),
    ("src/tracking/recording.rs", "thread", "`FrameRecorder::error` says that there are no threads"),
];

/// The code of a file: without comments and without the unit tests at its foot.
fn code(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    let tests = lines.windows(2).position(|pair| pair[0] == "#[cfg(test)]" && pair[1].starts_with("mod "));
    let of_game = lines[..tests.unwrap_or(lines.len())].iter();
    of_game.filter(|line| !line.trim_start().starts_with("//")).map(|line| format!("{}\n", line.trim())).collect()
}

/// Parts of a path or of an import list of the standard library, as words: of `use std::{fs, time::Instant}` both.
fn std_words(code: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (start, _) in code.match_indices("std::") {
        // `std` is a word of its own
        if code[..start].ends_with(|before: char| before.is_alphanumeric() || before == '_') {
            continue;
        }
        let after = &code[start..];
        let is_import = code[..start].ends_with("use ");
        let end = match is_import {
            true => after.find(';'),
            false => after.find(|letter: char| !(letter.is_alphanumeric() || letter == '_' || letter == ':')),
        };
        let path = &after[..end.unwrap_or(after.len())];
        words.extend(path.split(|letter: char| !(letter.is_alphanumeric() || letter == '_')).map(str::to_owned));
    }
    words
}

/// What of [`ABSENT`] a file uses.
fn used(text: &str) -> Vec<&'static str> {
    let code = code(text);
    let words = std_words(&code);
    let is_used = |name: &str| match name.contains(|letter: char| !letter.is_alphanumeric() && letter != '_') {
        true => code.contains(name),
        false => words.iter().any(|word| word == name),
    };
    ABSENT.iter().map(|(name, _)| *name).filter(|name| is_used(name)).collect()
}

#[test]
fn the_portable_part_neither_waits_nor_reads_the_clock_of_the_system() {
    let mut wrong = Vec::new();
    let mut allowed: Vec<_> = ALLOWED.iter().map(|(path, name, _)| (*path, *name)).collect();
    for file in sources(&["src"]) {
        if !file.path.ends_with(".rs") || NATIVE.iter().any(|native| file.path.starts_with(native)) {
            continue;
        }
        for name in used(&file.text) {
            if let Some(place) = allowed.iter().position(|allowed| *allowed == (&*file.path, name)) {
                allowed.swap_remove(place);
            } else {
                let instead = ABSENT.iter().find(|(absent, _)| *absent == name).expect("one of them").1;
                wrong.push(format!("{}: {name}; use {instead}", file.path));
            }
        }
    }
    assert!(wrong.is_empty(), "not for the web (docs/WEB.md):\n{}", wrong.join("\n"));
    assert!(allowed.is_empty(), "allowed in vain: {allowed:?}");
}

#[test]
fn imports_paths_and_calls_are_noticed() {
    assert_eq!(used("use std::{\n    fs,\n    time::{Duration, Instant},\n};"), ["Instant", "fs"]);
    assert_eq!(used("let a = std::thread::spawn(f);"), ["thread"]);
    assert_eq!(used("let found = block_on(task);\nlet next = frames.recv();"), ["block_on(", ".recv("]);
    assert_eq!(used("use std::time::Duration;\nuse bevy::platform::time::Instant;\nlet a = Instant::now();"), [""; 0]);
    assert_eq!(used("// std::fs\nuse a::my_std::fs;\n#[cfg(test)]\nmod tests {\n    use std::fs;\n}"), [""; 0]);
}
