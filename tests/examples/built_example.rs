//! The examples as cargo built them beside the tests.

use std::{
    path::{Path, PathBuf},
    process::{Command, Output},
    sync::RwLock,
};

/// `dance_stage` reports its memory, which depends on how busy the machine is, so it runs alone. Others run beside each
/// other.
static RUNNING: RwLock<()> = RwLock::new(());

/// Runs an example without a display, as on a server. `None` with a printed reason if it was not built or has nothing
/// to draw with; with `MIRRORBALL_REQUIRE_GPU` set (as in CI) that is a failure.
pub(crate) fn run(name: &str, arguments: &[&str]) -> Option<Output> {
    let is_skipping_allowed = std::env::var_os("MIRRORBALL_REQUIRE_GPU").is_none();
    let tests = std::env::current_exe().expect("a test knows where it is");
    let program = tests.ancestors().nth(2).expect("tests lie in target/PROFILE/deps").join("examples").join(name);
    if !program.exists() {
        println!("skipped: {} is not built; run all tests or build the example", program.display());
        assert!(is_skipping_allowed, "MIRRORBALL_REQUIRE_GPU forbids skipping");
        return None;
    }
    let (_alone, _beside) =
        if name == "dance_stage" { (RUNNING.write().ok(), None) } else { (None, RUNNING.read().ok()) };
    let output = Command::new(program)
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("CARGO_MANIFEST_DIR", env!("CARGO_MANIFEST_DIR"))
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY")
        .output()
        .expect("the example starts");
    let said = String::from_utf8_lossy(&output.stderr);
    // The crate's own words, and Bevy's.
    let has_no_adapter = ["no graphics adapter", "Unable to find a GPU"].iter().any(|words| said.contains(words));
    if has_no_adapter && is_skipping_allowed {
        println!("skipped: {said}");
        return None;
    }
    Some(output)
}

/// A path of this name for what the tests write.
pub(crate) fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}
