//! The kernel's USB video driver with an emulated camera: JPEGs, damage and exposure.

use super::*;
use crate::camera::webcam::{DeviceEncoding, DeviceExposure, format::PixelFormat};
use image::codecs::jpeg::JpegEncoder;
use std::{
    path::Path,
    process::{Child, Command},
};

const USB_CAMERA: &str = "Emulated UVC Camera";

/// The emulated USB camera. Killing its process unplugs it.
struct UsbCamera {
    process: Child,
    _guard: MutexGuard<'static, ()>,
}

impl UsbCamera {
    /// Starts the emulator. The arguments are its options and the names of the images that it sends in turn.
    fn plug_in(arguments: &[&str]) -> Option<Self> {
        let guard = CAMERA.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(program) = env::var_os("MIRRORBALL_USB_CAMERA") else {
            return skip("MIRRORBALL_USB_CAMERA does not name the emulated camera");
        };
        let folder = env::temp_dir().join("mirrorball_usb_camera");
        write_images(&folder);
        let process = Command::new(program).args(arguments).current_dir(folder).spawn().expect("the emulator starts");
        let camera = Self { process, _guard: guard };
        assert!(wait_until(MAX_WAIT, || list_devices().iter().any(|device| device.name.contains(USB_CAMERA))));
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
        wait_until(MAX_WAIT, || list_devices().iter().all(|device| !device.name.contains(USB_CAMERA)));
    }
}

/// Writes three images of one scene, a white one, a truncated one and garbage.
fn write_images(folder: &Path) {
    fs::create_dir_all(folder).expect("is writable");
    let write = |name: &str, bytes: &[u8]| fs::write(folder.join(name), bytes).expect("is writable");
    let encoded = |color: &dyn Fn(u32, u32) -> [u8; 3]| {
        let mut jpeg = Vec::new();
        let image = image::RgbImage::from_fn(640, 480, |x, y| image::Rgb(color(x, y)));
        JpegEncoder::new_with_quality(&mut jpeg, 75).encode_image(&image).expect("is encoded");
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
    // The emulated camera is white at exposures of a tenth of a second and longer.
    let webcam = Webcam::open(DeviceOptions { exposure: DeviceExposure::Seconds(0.12), ..UsbCamera::options() });
    let bright = mean_rgb(&next(&webcam));
    assert_eq!(wait_for_playing(&webcam).exposure, Some(0.12));
    assert!(bright.min_element() > 250.0 && dark.max_element() < 200.0, "{bright} {dark}");
}

/// Number of frames of the usual exposure during which the rounds are observed; at 30 per second, at least three
/// rounds.
const WATCHED_FRAMES: usize = 150;

#[test]
fn an_exposure_bracket_is_sorted_correctly_however_late_the_camera_is() {
    for late in ["0", "3"] {
        let Some(_camera) = UsbCamera::plug_in(&["-L", late, "-b", "bright.jpg", "f1.jpg", "f2.jpg", "f3.jpg"]) else {
            return;
        };
        let options = DeviceOptions {
            exposure: DeviceExposure::Seconds(0.12),
            shorter_exposures: vec![0.25, 0.05],
            ..UsbCamera::options()
        };
        let webcam = Webcam::open(options);
        let (mut usual, mut shorter) = (0, Vec::new());
        while usual < WATCHED_FRAMES {
            let bright = next(&webcam);
            usual += 1 + bright.dropped as usize;
            // The emulated camera is white at exposures of a tenth of a second and longer.
            assert!(bright.exposure == 1.0 && mean_rgb(&bright).min_element() > 250.0, "{}", mean_rgb(&bright));
            for dark in webcam.take_shorter() {
                assert!(mean_rgb(&dark).max_element() < 200.0, "{} at {}", mean_rgb(&dark), dark.exposure);
                shorter.push(dark.exposure);
            }
        }
        let stream = wait_for_playing(&webcam);
        assert_eq!((stream.exposure, stream.shorter_exposures), (Some(0.12), vec![0.25, 0.05]));
        assert!(shorter.len() >= 4 && shorter.chunks(2).all(|round| round[0] == 0.25), "{shorter:?}");
        println!("{late} late: {} shorter exposures beside {usual} usual ones", shorter.len());
    }
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
        let frame = next(&webcam);
        dropped += frame.dropped;
        means.push(mean_rgb(&frame));
    }
    assert!(dropped >= 8, "{dropped}");
    // Intact frames of one scene are alike; half gray ones are not.
    assert!(means.iter().all(|mean| mean.distance(means[0]) < 5.0), "{means:?}");
    drop((webcam, camera));
    let Some(_camera) = UsbCamera::plug_in(&["junk.jpg", "cut.jpg"]) else {
        return;
    };
    let webcam = Webcam::open(UsbCamera::options());
    let text = wait_for_lost(&webcam, MAX_WAIT);
    assert!(text.contains("damaged") && webcam.take().is_none(), "{text}");
}

#[test]
fn empty_frames_are_dropped() {
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
    let images = &["f1.jpg", "f2.jpg", "f3.jpg"];
    let Some(camera) = UsbCamera::plug_in(images) else {
        return;
    };
    let webcam = Webcam::open(UsbCamera::options());
    wait_for_playing(&webcam);
    drop(camera);
    wait_for_lost(&webcam, Duration::from_secs(2));
    let Some(_camera) = UsbCamera::plug_in(images) else {
        return;
    };
    webcam.take();
    wait_for_playing(&webcam);
    next(&webcam);
}
