//! Live pictures from webcams.
//!
//! **Enters:** [`DeviceOptions`]: which camera, and what is asked of it. **Leaves:** the newest picture as 8-bit sRGB
//! [`FramePixels`](super::FramePixels) with the instant it was taken, and a [`WebcamStatus`].
//!
//! # How it works
//! Each [`Webcam`] owns one thread that finds the camera, chooses a mode ([`mod@format`]), takes pictures, decodes them
//! ([`decode`], [`jpeg`]) and puts the newest where the game finds it: newest wins, older ones are counted and forgotten.
//! A camera that is missing, busy, forbidden, unplugged or silent is a state with a text that says what to do; the thread
//! looks again every second, by the camera's *name*, since a camera that is plugged in again often has another number.
//! Nothing here waits for the thread: dropping a [`Webcam`] tells it to stop and goes on.
//!
//! # Shorter exposures
//! With [`DeviceOptions::shorter_exposures`] the thread goes through them every two seconds and throws away the pictures
//! whose exposure is uncertain ([`exposure_bracket`]).
//!
//! # Platforms
//! Linux is driven through V4L2 directly (crate `v4l`), elsewhere `nokhwa` is used. On Linux `nokhwa` 0.10 throws away what
//! this needs: how many bytes of a picture arrived and whether the driver marked it as damaged (a cut JPEG shows old rows),
//! the row length (padded rows come out sheared) and frame rates that are no whole numbers (the camera cannot be opened
//! any more); and it waits for pictures without a limit. On Windows and macOS that wait remains: the status still says
//! that pictures are missing, but a stopped thread ends only with the next picture. Linux is tested against the kernel's
//! own drivers (`scripts/test_webcam.sh`); the other two are compiled and not tested.
//!
//! # Cost
//! One thread per camera; decoding a 640 × 480 picture takes about a millisecond of it in release builds.
//!
//! # Limits
//! YUYV, NV12, RGB, BGR, gray and JPEG pictures in one plane. `Y'CbCr` is taken as ITU-R BT.601 with limited range, which is
//! what the USB video class prescribes by default; JPEG as JFIF (BT.601, full range). The transfer function is taken as
//! sRGB's.

mod capture;
mod decode;
mod devices;
mod exposure_bracket;
mod format;
mod jpeg;
#[cfg(all(test, target_os = "linux"))]
mod live_tests;
#[cfg(not(target_os = "linux"))]
mod nokhwa;
mod stream;
#[cfg(target_os = "linux")]
mod v4l2;

#[cfg(not(target_os = "linux"))]
use self::nokhwa as source;
#[cfg(target_os = "linux")]
use v4l2 as source;

pub(super) use capture::Webcam;
pub use devices::{DeviceEncoding, DeviceExposure, DeviceId, DeviceInfo, DeviceOptions, list_devices};
pub(super) use stream::{Captured, WebcamStatus};
