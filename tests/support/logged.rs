//! What a test says in the log. A process has one logger, so the test runs again in a process of its own.

use std::process::Command;

const IS_LOGGED: &str = "MIRRORBALL_LOGGED_TEST";

/// Output and log of a test, given by its whole name, or `None` in the process that is to add Bevy's `LogPlugin` and
/// do what is logged.
pub(crate) fn log_of(test: &str) -> Option<String> {
    if std::env::var_os(IS_LOGGED).is_some() {
        return None;
    }
    let mut again = Command::new(std::env::current_exe().expect("this test"));
    let output = again.args([test, "--exact", "--nocapture"]).env(IS_LOGGED, "1").env("NO_COLOR", "1").output();
    let output = output.expect("it can be run");
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(output.status.success() && said.contains("1 passed"), "{said}");
    Some(said)
}

/// Number of warnings with all of some words.
pub(crate) fn warnings(log: &str, words: &[&str]) -> usize {
    log.lines().filter(|line| line.contains("WARN") && words.iter().all(|word| line.contains(word))).count()
}
