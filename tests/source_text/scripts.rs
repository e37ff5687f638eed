//! The scripts for machines that have nothing set up.

use std::process::Command;

/// Prints the runtime folder and its mode after `scripts/runtime_folder.sh`, for what `XDG_RUNTIME_DIR` was before.
fn runtime_folder(before: Option<&str>) -> Option<(String, String)> {
    let script = "source scripts/runtime_folder.sh; echo \"$XDG_RUNTIME_DIR\"; stat -c %a \"$XDG_RUNTIME_DIR\"";
    let mut bash = Command::new("bash");
    bash.args(["-euo", "pipefail", "-c", script]).current_dir(env!("CARGO_MANIFEST_DIR")).env_remove("XDG_RUNTIME_DIR");
    let Ok(output) = bash.envs(before.map(|folder| ("XDG_RUNTIME_DIR", folder))).output() else {
        println!("skipped: there is no bash");
        return None;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout);
    let (folder, mode) = said.trim().split_once('\n').expect("two lines");
    Some((folder.to_owned(), mode.to_owned()))
}

#[cfg(target_os = "linux")]
#[test]
fn a_private_runtime_folder_is_made_where_there_is_none() {
    for before in [None, Some(""), Some("/no such folder"), Some("target")] {
        let Some((folder, mode)) = runtime_folder(before) else { return };
        assert!(folder.starts_with('/') && std::path::Path::new(&folder).is_dir(), "{before:?}: {folder}");
        assert_eq!(mode, "700", "{before:?}: {folder}");
    }
    let own = env!("CARGO_TARGET_TMPDIR");
    assert_eq!(runtime_folder(Some(own)).map(|(folder, _)| folder).as_deref(), Some(own), "a folder that exists stays");
}

#[test]
fn every_script_that_draws_has_a_runtime_folder() {
    for script in
        ["scripts/run.sh", "scripts/test.sh", "scripts/measure.sh", "scripts/make_readme_pictures.sh", ".ci/run"]
    {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(script);
        let text = std::fs::read_to_string(path).expect("a script of the repository");
        assert!(text.contains("source scripts/runtime_folder.sh"), "{script}");
    }
}
