//! Live frames from webcams.
//!
//! **Enters:** [`DeviceOptions`]: the camera and the requested settings. **Leaves:** the newest frame as 8-bit sRGB
//! [`FramePixels`](super::FramePixels) with the instant of its capture, and a [`WebcamStatus`].
//!
//! # How it works
//! Each [`Webcam`] owns one thread that finds the camera, chooses a mode ([`mod@format`]), captures frames and decodes
//! them ([`decode`], [`jpeg`]). The game reads the newest frame; frames that it has not read by then are counted and
//! dropped. A camera that is missing, busy, forbidden, unplugged or silent is a state with a text that says what to do.
//! The thread searches for the camera again every second, by its *name*, because a camera that is plugged in again
//! often has another number. Nothing here waits for the thread: dropping a [`Webcam`] signals it to stop and returns at
//! once.
//!
//! # Exposure bracketing
//! With [`DeviceOptions::shorter_exposures`] the thread captures each of them every two seconds and discards the frames
//! whose exposure is uncertain ([`exposure_bracket`]).
//!
//! # Platforms
//! Linux uses V4L2 directly (crate `v4l`), other systems use `nokhwa`. On Linux, `nokhwa` 0.10 discards information
//! that is needed here: how many bytes of a frame arrived and whether the driver marked it as damaged (a truncated JPEG
//! shows old rows), the row length (padded rows come out sheared), and frame rates that are not whole numbers (the
//! camera can no longer be opened). It also waits for frames without a time limit. On Windows and macOS that wait
//! remains: the status still reports missing frames, but a stopped thread ends only with the next frame. Linux is
//! tested against the kernel's own drivers (`scripts/test_webcam.sh`); the other two are compiled and not tested.
//!
//! # Cost
//! One thread per camera. Decoding a 640 × 480 frame takes about a millisecond of its time in release builds.
//!
//! # Limits
//! Supported formats are YUYV, NV12, RGB, BGR, gray and JPEG, in one plane. `Y'CbCr` is interpreted as ITU-R BT.601
//! with limited range, the default of the USB video class, and JPEG as JFIF (BT.601, full range). The transfer function
//! is assumed to be that of sRGB.

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
