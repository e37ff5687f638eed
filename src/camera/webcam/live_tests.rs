//! Tests against real drivers: vivid, the kernel's virtual camera, and the USB video driver with an emulated webcam.
//!
//! They skip with a printed reason where there is none, and run in a small virtual machine: `scripts/test_webcam.sh`. There
//! `MIRRORBALL_USB_CAMERA` names the emulator, and `MIRRORBALL_REQUIRE_CAMERA` turns a skip into a failure.

use super::{
    Captured, DeviceEncoding, DeviceExposure, DeviceId, DeviceOptions, Webcam, WebcamStatus, capture::WebcamStream,
    format::PixelFormat, list_devices,
};
use bevy::prelude::*;
use image::codecs::jpeg::JpegEncoder;
use std::{
    env, fs,
    path::Path,
    process::{Child, Command},
    sync::{Mutex, MutexGuard, PoisonError},
    thread::sleep,
    time::{Duration, Instant},
};
use v4l::control::{Control, Value};

/// The virtual machine is slow; nothing that works takes as long.
const LONG: Duration = Duration::from_secs(20);
const VIVID_DRIVER: &str = "/sys/bus/platform/drivers/vivid";
/// The control of vivid that stalls it at 100.
const DROPPED: &str = "Percentage of Dropped Buffers";
const USB_CAMERA: &str = "Emulated UVC Camera";

/// One camera at a time.
static CAMERA: Mutex<()> = Mutex::new(());

fn skip<T>(reason: &str) -> Option<T> {
    assert!(env::var_os("MIRRORBALL_REQUIRE_CAMERA").is_none(), "a camera is required, but {reason}");
    eprintln!("skipped: {reason}");
    None
}

/// vivid, if it is loaded. Plugged in again and healed when it goes out of scope, whatever became of the test.
struct Vivid(#[expect(dead_code, reason = "held")] MutexGuard<'static, ()>);

impl Vivid {
    fn get() -> Option<Self> {
        let guard = CAMERA.lock().unwrap_or_else(PoisonError::into_inner);
        if list_devices().iter().any(|device| device.name.contains("vivid")) {
            return Some(Self(guard));
        }
        skip("the driver vivid is not loaded")
    }

    fn options() -> DeviceOptions {
        DeviceOptions { device: DeviceId::Name("vivid".to_owned()), ..default() }
    }

    fn unplug(&self) {
        fs::write(format!("{VIVID_DRIVER}/unbind"), "vivid.0").expect("unbinds");
    }

    fn plug_in(&self) {
        fs::write(format!("{VIVID_DRIVER}/bind"), "vivid.0").expect("binds");
    }

    fn set(&self, control: &str, value: i64) {
        let info = list_devices().into_iter().find(|device| device.name.contains("vivid")).expect("is there");
        let device = v4l::Device::new(info.index as usize).expect("opens");
        let controls = device.query_controls().expect("lists its controls");
        let id = controls.iter().find(|known| known.name == control).expect("knows the control").id;
        device.set_control(Control { id, value: Value::Integer(value) }).expect("is set");
    }
}

impl Drop for Vivid {
    fn drop(&mut self) {
        if list_devices().iter().any(|device| device.name.contains("vivid")) {
            self.set(DROPPED, 0);
        } else {
            self.plug_in();
        }
    }
}

/// The emulated USB camera; killing its process unplugs it.
struct UsbCamera {
    process: Child,
    _guard: MutexGuard<'static, ()>,
}

impl UsbCamera {
    /// Options of the emulator and names of the pictures that it sends in turn.
    fn plug_in(arguments: &[&str]) -> Option<Self> {
        let guard = CAMERA.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(program) = env::var_os("MIRRORBALL_USB_CAMERA") else {
            return skip("MIRRORBALL_USB_CAMERA does not name the emulated camera");
        };
        let folder = env::temp_dir().join("mirrorball_usb_camera");
        write_pictures(&folder);
        let process = Command::new(program).args(arguments).current_dir(folder).spawn().expect("the emulator starts");
        let camera = Self { process, _guard: guard };
        assert!(wait_until(LONG, || list_devices().iter().any(|device| device.name.contains(USB_CAMERA))));
        Some(camera)
    }

    fn options() -> DeviceOptions {
        let device = DeviceId::Name(USB_CAMERA.to_owned());
        DeviceOptions { device, encoding: DeviceEncoding::Jpeg, ..default() }
    }
}

impl Drop for UsbCamera {
    fn drop(&mut self) {
        self.process.kill().expect("the emulator runs");
        self.process.wait().expect("the emulator ends");
        wait_until(LONG, || list_devices().iter().all(|device| !device.name.contains(USB_CAMERA)));
    }
}

/// Three pictures of one scene, a white one, one cut off and rubbish.
fn write_pictures(folder: &Path) {
    fs::create_dir_all(folder).expect("is writable");
    let write = |name: &str, bytes: &[u8]| fs::write(folder.join(name), bytes).expect("is writable");
    let encoded = |color: &dyn Fn(u32, u32) -> [u8; 3]| {
        let mut jpeg = Vec::new();
        let picture = image::RgbImage::from_fn(640, 480, |x, y| image::Rgb(color(x, y)));
        JpegEncoder::new_with_quality(&mut jpeg, 75).encode_image(&picture).expect("is encoded");
        jpeg
    };
    for (name, shift) in [("f1.jpg", 0), ("f2.jpg", 40), ("f3.jpg", 80)] {
        let jpeg = encoded(&|x, y| [((x + shift) % 160) as u8, (y / 4) as u8, ((x ^ y) % 32) as u8]);
        write(name, &jpeg);
        if shift == 0 {
            write("cut.jpg", &jpeg[..jpeg.len() / 2]);
        }
    }
    write("bright.jpg", &encoded(&|_, _| [255; 3]));
    write("junk.jpg", &[0x55; 400]);
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
    wait_until(LONG, || {
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
        wait_until(LONG, || {
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

#[test]
fn thirty_distinct_pictures_come_with_rising_times() {
    let Some(_vivid) = Vivid::get() else {
        return;
    };
    let webcam = Webcam::open(Vivid::options());
    let mut last = next(&webcam);
    assert_eq!(last.pixels.size, UVec2::new(640, 480));
    // vivid's color bars at their default brightness, as another decoder saw them.
    let mean = mean_rgb(&last);
    assert!(mean.abs_diff_eq(Vec3::new(84.5, 80.6, 87.3), 2.0), "{mean}");
    for _ in 0..30 {
        let new = next(&webcam);
        assert!(new.pixels.rgba != last.pixels.rgba && new.at > last.at && new.at <= Instant::now());
        last = new;
    }
    let stream = wait_for_playing(&webcam);
    assert_eq!((stream.size, stream.format, stream.frame_rate), (UVec2::new(640, 480), PixelFormat::Yuyv, 25.0));
}

#[test]
fn wishes_are_met_as_near_as_the_camera_can_and_broken_rates_are_left_without_harm() {
    let Some(_vivid) = Vivid::get() else {
        return;
    };
    for (size, rate, taken, at) in [
        ((1280, 720), 12.5, (1280, 720), 12.5),
        ((640, 480), 30.0, (640, 480), 25.0),
        ((300, 200), 60.0, (320, 180), 60.0),
        ((9000, 9000), 1.0, (3840, 2160), 1.0),
    ] {
        let wish = DeviceOptions { size: Some(size.into()), frame_rate: Some(rate), ..Vivid::options() };
        let webcam = Webcam::open(wish);
        assert_eq!(next(&webcam).pixels.size, taken.into());
        let stream = wait_for_playing(&webcam);
        assert_eq!((stream.size, stream.frame_rate), (taken.into(), at));
    }
}

#[test]
fn a_camera_that_is_not_there_is_lost_and_the_remedy_is_named() {
    let Some(_vivid) = Vivid::get() else {
        return;
    };
    for device in [DeviceId::Index(63), DeviceId::Name("no such camera".to_owned())] {
        let webcam = Webcam::open(DeviceOptions { device, ..default() });
        let text = wait_for_lost(&webcam, LONG);
        assert!(text.contains("Connect it") && text.contains("vivid"), "{text}");
        assert!(webcam.take().is_none());
    }
}

#[test]
fn an_unplugged_camera_is_lost_at_once_and_plays_again_when_it_is_back() {
    let Some(vivid) = Vivid::get() else {
        return;
    };
    let webcam = Webcam::open(Vivid::options());
    wait_for_playing(&webcam);
    for _ in 0..2 {
        vivid.unplug();
        let text = wait_for_lost(&webcam, Duration::from_secs(2));
        assert!(text.contains("unplugged"), "{text}");
        sleep(Duration::from_millis(1500));
        let text = wait_for_lost(&webcam, Duration::ZERO);
        assert!(text.contains("is gone") || text.contains("unplugged"), "{text}");
        webcam.take();
        vivid.plug_in();
        wait_for_playing(&webcam);
        next(&webcam);
    }
}

#[test]
fn a_stalled_camera_is_lost_and_recovers_by_itself() {
    let Some(vivid) = Vivid::get() else {
        return;
    };
    let webcam = Webcam::open(Vivid::options());
    wait_for_playing(&webcam);
    vivid.set(DROPPED, 100);
    let text = wait_for_lost(&webcam, Duration::from_secs(4));
    vivid.set(DROPPED, 0);
    assert!(text.contains("no picture from"), "{text}");
    wait_for_playing(&webcam);
    next(&webcam);
    // One that stalls for long is opened again.
    vivid.set(DROPPED, 100);
    let text = wait_for_lost(&webcam, Duration::from_secs(4));
    assert!(text.contains("for 2 s"), "{text}");
    let is_reopened =
        wait_until(LONG, || matches!(webcam.status(), WebcamStatus::Lost(text) if text.contains("for 10 s")));
    vivid.set(DROPPED, 0);
    assert!(is_reopened);
    wait_for_playing(&webcam);
}

#[test]
fn errors_of_the_driver_are_healed() {
    let Some(vivid) = Vivid::get() else {
        return;
    };
    let webcam = Webcam::open(Vivid::options());
    wait_for_playing(&webcam);
    vivid.set("Inject Fatal Streaming Error", 1);
    wait_for_lost(&webcam, Duration::from_secs(4));
    wait_for_playing(&webcam);
    drop(webcam);
    for error in ["Inject VIDIOC_REQBUFS Error", "Inject VIDIOC_QBUF Error", "Inject VIDIOC_STREAMON Error"] {
        // The thread of the webcam before may still be closing the camera.
        sleep(Duration::from_millis(300));
        vivid.set(error, 1);
        let webcam = Webcam::open(Vivid::options());
        wait_for_lost(&webcam, LONG);
        wait_for_playing(&webcam);
    }
}

#[test]
fn a_busy_camera_says_so_and_plays_when_it_is_free() {
    let Some(_vivid) = Vivid::get() else {
        return;
    };
    let first = Webcam::open(Vivid::options());
    wait_for_playing(&first);
    let second = Webcam::open(Vivid::options());
    let text = wait_for_lost(&second, LONG);
    assert!(text.contains("in use"), "{text}");
    next(&first);
    drop(first);
    wait_for_playing(&second);
}

#[test]
fn a_camera_may_be_closed_and_opened_many_times() {
    let Some(_vivid) = Vivid::get() else {
        return;
    };
    let open_files = || fs::read_dir("/proc/self/fd").map_or(0, Iterator::count);
    let before = open_files();
    for _ in 0..5 {
        let webcam = Webcam::open(Vivid::options());
        next(&webcam);
        let closing = Instant::now();
        drop(webcam);
        assert!(closing.elapsed() < Duration::from_millis(50));
    }
    assert!(wait_until(LONG, || open_files() <= before));
}

#[test]
fn a_usb_camera_sends_jpegs_and_takes_a_fixed_exposure() {
    let Some(_camera) = UsbCamera::plug_in(&["-b", "bright.jpg", "f1.jpg", "f2.jpg", "f3.jpg"]) else {
        return;
    };
    let webcam = Webcam::open(UsbCamera::options());
    let first = next(&webcam);
    let stream = wait_for_playing(&webcam);
    assert_eq!((stream.format, stream.frame_rate.round(), stream.exposure), (PixelFormat::Mjpeg, 30.0, None));
    assert!(next(&webcam).pixels.rgba != first.pixels.rgba);
    let dark = mean_rgb(&first);
    drop(webcam);
    // The emulated camera shows white from a tenth of a second on.
    let webcam = Webcam::open(DeviceOptions { exposure: DeviceExposure::Seconds(0.12), ..UsbCamera::options() });
    let bright = mean_rgb(&next(&webcam));
    assert_eq!(wait_for_playing(&webcam).exposure, Some(0.12));
    assert!(bright.min_element() > 250.0 && dark.max_element() < 200.0, "{bright} {dark}");
}

#[test]
fn damaged_jpegs_are_dropped_and_counted() {
    let Some(camera) = UsbCamera::plug_in(&["f1.jpg", "junk.jpg", "cut.jpg", "f2.jpg"]) else {
        return;
    };
    let webcam = Webcam::open(UsbCamera::options());
    let mut dropped = 0;
    let mut means = Vec::new();
    for _ in 0..10 {
        let picture = next(&webcam);
        dropped += picture.dropped;
        means.push(mean_rgb(&picture));
    }
    assert!(dropped >= 8, "{dropped}");
    // Whole pictures of one scene are alike; half gray ones are not.
    assert!(means.iter().all(|mean| mean.distance(means[0]) < 5.0), "{means:?}");
    drop((webcam, camera));
    let Some(_camera) = UsbCamera::plug_in(&["junk.jpg", "cut.jpg"]) else {
        return;
    };
    let webcam = Webcam::open(UsbCamera::options());
    let text = wait_for_lost(&webcam, LONG);
    assert!(text.contains("damaged") && webcam.take().is_none(), "{text}");
}

#[test]
fn empty_pictures_are_dropped() {
    let Some(_camera) = UsbCamera::plug_in(&["-E", "2", "f1.jpg", "f2.jpg"]) else {
        return;
    };
    let webcam = Webcam::open(UsbCamera::options());
    for _ in 0..6 {
        next(&webcam);
    }
}

#[test]
fn an_unplugged_usb_camera_is_found_again_by_its_name() {
    let pictures = &["f1.jpg", "f2.jpg", "f3.jpg"];
    let Some(camera) = UsbCamera::plug_in(pictures) else {
        return;
    };
    let webcam = Webcam::open(UsbCamera::options());
    wait_for_playing(&webcam);
    drop(camera);
    wait_for_lost(&webcam, Duration::from_secs(2));
    let Some(_camera) = UsbCamera::plug_in(pictures) else {
        return;
    };
    webcam.take();
    wait_for_playing(&webcam);
    next(&webcam);
}
