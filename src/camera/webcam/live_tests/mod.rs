//! Tests against real drivers: vivid, the kernel's virtual camera, and the USB video driver with an emulated webcam.
//!
//! Without these drivers the tests are skipped with a printed reason. `scripts/test_webcam.sh` runs them in a small
//! virtual machine, where `MIRRORBALL_USB_CAMERA` names the emulator and `MIRRORBALL_REQUIRE_CAMERA` turns a skip into
//! a failure.

mod usb;
mod vivid;

use super::{
    DeviceId, DeviceOptions, Webcam, WebcamStatus, list_devices,
    stream::{Captured, WebcamStream},
};
use bevy::prelude::*;
use std::{
    env, fs,
    sync::{Mutex, MutexGuard, PoisonError},
    thread::sleep,
    time::{Duration, Instant},
};

/// Longest wait for anything in the slow virtual machine. Nothing that works takes as long.
const MAX_WAIT: Duration = Duration::from_secs(20);

/// Lock that lets one test at a time use a camera.
static CAMERA: Mutex<()> = Mutex::new(());

fn skip<T>(reason: &str) -> Option<T> {
    assert!(env::var_os("MIRRORBALL_REQUIRE_CAMERA").is_none(), "a camera is required, but {reason}");
    eprintln!("skipped: {reason}");
    None
}

fn wait_until(limit: Duration, mut is_so: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while !is_so() {
        if start.elapsed() > limit {
            return false;
        }
        sleep(Duration::from_millis(10));
    }
    true
}

fn wait_for_lost(webcam: &Webcam, limit: Duration) -> String {
    let mut text = String::new();
    let is_lost = wait_until(limit, || match webcam.status() {
        WebcamStatus::Lost(reason) => {
            text = reason;
            true
        }
        _ => false,
    });
    assert!(is_lost, "{:?}", webcam.status());
    text
}

fn wait_for_playing(webcam: &Webcam) -> WebcamStream {
    let mut playing = None;
    wait_until(MAX_WAIT, || {
        if let WebcamStatus::Playing(stream) = webcam.status() {
            playing = Some(stream);
        }
        playing.is_some()
    });
    playing.unwrap_or_else(|| panic!("{:?}", webcam.status()))
}

fn next(webcam: &Webcam) -> Captured {
    let mut captured = None;
    assert!(
        wait_until(MAX_WAIT, || {
            captured = webcam.take();
            captured.is_some()
        }),
        "{:?}",
        webcam.status()
    );
    captured.expect("was just seen")
}

fn mean_rgb(captured: &Captured) -> Vec3 {
    let sum = captured.pixels.rgba.chunks(4).map(|p| Vec3::new(p[0].into(), p[1].into(), p[2].into())).sum::<Vec3>();
    sum / captured.pixels.size.element_product() as f32
}
