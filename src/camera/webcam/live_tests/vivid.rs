//! The kernel's virtual camera: modes, unplugging, stalls and errors of the driver.

use super::*;
use crate::camera::webcam::format::PixelFormat;
use v4l::control::{Control, Value};

const VIVID_DRIVER: &str = "/sys/bus/platform/drivers/vivid";
/// The control of vivid that stalls it at 100.
const DROPPED: &str = "Percentage of Dropped Buffers";

/// The driver vivid, if it is loaded. When dropped, it is plugged in again and its settings are restored, whatever the
/// result of the test.
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

#[test]
fn thirty_distinct_frames_come_with_rising_times() {
    let Some(_vivid) = Vivid::get() else {
        return;
    };
    let webcam = Webcam::open(Vivid::options());
    let mut last = next(&webcam);
    assert_eq!(last.pixels.size, UVec2::new(640, 480));
    // Mean of vivid's color bars at their default brightness, from another decoder.
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
        let text = wait_for_lost(&webcam, MAX_WAIT);
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
    // A camera that stalls for long is opened again.
    vivid.set(DROPPED, 100);
    let text = wait_for_lost(&webcam, Duration::from_secs(4));
    assert!(text.contains("for 2 s"), "{text}");
    let is_reopened =
        wait_until(MAX_WAIT, || matches!(webcam.status(), WebcamStatus::Lost(text) if text.contains("for 10 s")));
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
        // The thread of the previous webcam may still be closing the camera.
        sleep(Duration::from_millis(300));
        vivid.set(error, 1);
        let webcam = Webcam::open(Vivid::options());
        wait_for_lost(&webcam, MAX_WAIT);
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
    let text = wait_for_lost(&second, MAX_WAIT);
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
    assert!(wait_until(MAX_WAIT, || open_files() <= before));
}
