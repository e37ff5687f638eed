//! Whether there is a display.

/// Returns whether a window can be opened. Only on Linux a desktop can be missing.
pub(crate) fn has_display() -> bool {
    !cfg!(target_os = "linux") || std::env::var_os("DISPLAY").is_some_and(|display| !display.is_empty())
}
