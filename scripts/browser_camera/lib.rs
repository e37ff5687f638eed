//! The browser's camera alone, without Bevy, and functions with which a page tests it; see
//! `scripts/test_browser_camera.sh`.

#[path = "../../src/camera/browser/mod.rs"]
mod browser;
mod page;

pub use browser::{BrowserCameraOptions, CameraFacing};
