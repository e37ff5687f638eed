//! Connected cameras, and the settings that can be requested from one.

use super::source;
use bevy::prelude::*;
use std::panic::catch_unwind;

/// Identification of a camera.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum DeviceId {
    /// The first camera that [`list_devices`] finds.
    #[default]
    First,
    /// The number that the system gives the camera: 2 is `/dev/video2` on Linux. Numbers change when cameras are
    /// plugged in; therefore a camera that was found by its number is identified by its name from then on.
    Index(u32),
    /// The camera's name as [`list_devices`] returns it, or a part of the name, ignoring case. A camera with exactly
    /// this name takes precedence.
    Name(String),
}

/// Exposure time of a camera.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum DeviceExposure {
    /// The current setting of the camera: its own default, or what another program has set.
    #[default]
    Unchanged,
    /// Automatic exposure. The camera changes it while the game runs, and measured light changes with it.
    Automatic,
    /// A fixed exposure time in seconds, which makes measured light comparable from frame to frame. Webcams support
    /// about 0.0001 to 0.5, in steps of 0.0001, and less than the duration of a frame at the full frame rate. The
    /// camera uses the nearest value that it supports.
    ///
    /// Linux only. A camera that refuses keeps its setting, and a warning is logged.
    Seconds(f32),
}

/// Encoding in which frames are transferred from the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum DeviceEncoding {
    /// The encoding that best meets the requested size and rate; uncompressed if both do equally well.
    #[default]
    Any,
    /// Uncompressed: exact colors and corners, but many cameras deliver large frames slowly.
    Uncompressed,
    /// JPEG: a tenth of the data, for large frames, long cables and several cameras on one USB bus.
    Jpeg,
}

/// A camera and the settings requested from it. The size and rate nearest to the requested ones are used; the size has
/// priority.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::camera::{DeviceExposure, DeviceId, DeviceOptions};
/// let options = DeviceOptions {
///     device: DeviceId::Name("C920".into()),
///     size: Some(UVec2::new(1280, 720)),
///     exposure: DeviceExposure::Seconds(0.02),
///     // every two seconds also 2.5 and 0.2 ms, for lamps that clip otherwise
///     shorter_exposures: vec![0.125, 0.01],
///     ..default()
/// };
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceOptions {
    /// The camera. Defaults to the first one.
    pub device: DeviceId,
    /// Requested width and height in pixels; zero counts as one. Defaults to `None`: 640 × 480.
    pub size: Option<UVec2>,
    /// Requested frames per second. Values that are not finite and positive count as `None`. Defaults to `None`: 30.
    pub frame_rate: Option<f32>,
    /// Requested encoding. A camera that does not support it uses another one. Defaults to [`DeviceEncoding::Any`].
    pub encoding: DeviceEncoding,
    /// Exposure time. Defaults to [`DeviceExposure::Unchanged`].
    pub exposure: DeviceExposure,
    /// Exposure bracketing: shorter exposures that the camera takes in between, as fractions of the usual one, above 0
    /// and below 1. The usual exposure has to be [`DeviceExposure::Seconds`]. The additional frames resolve lamps that
    /// clip at the usual exposure ([`BracketedFrames`](crate::camera::BracketedFrames)); they are not shown. Defaults
    /// to none.
    ///
    /// Each shorter exposure is taken once every two seconds. Cameras apply a change of exposure some frames late, so
    /// that five frames for each shorter exposure and four more are not shown: with one of them at 30 frames per
    /// second, the image freezes for 0.3 s. Turn automatic white balance and gain off. Under lamps that flicker with
    /// the mains (100 or 120 times per second), exposures shorter than one period can catch any phase of it; such
    /// frames are ignored if the brightness of the marker's paper deviates by a quarter or more.
    ///
    /// Linux only. On other systems, or if the camera refuses, a warning is logged and all frames have the usual
    /// exposure.
    pub shorter_exposures: Vec<f32>,
}

/// Requested size if the game requests none: every webcam supports it, and marker detection is fast.
const DEFAULT_SIZE: UVec2 = UVec2::new(640, 480);
/// Requested frames per second if the game requests none.
const DEFAULT_FRAME_RATE: f32 = 30.0;

impl From<u32> for DeviceOptions {
    /// Returns options for the camera with this number, with defaults for everything else.
    fn from(index: u32) -> Self {
        Self { device: DeviceId::Index(index), ..default() }
    }
}

impl DeviceOptions {
    pub(super) fn wished_size(&self) -> UVec2 {
        self.size.unwrap_or(DEFAULT_SIZE).max(UVec2::ONE)
    }

    pub(super) fn wished_frame_rate(&self) -> f32 {
        self.frame_rate.filter(|rate| rate.is_finite() && *rate > 0.0).unwrap_or(DEFAULT_FRAME_RATE)
    }
}

/// A connected camera.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct DeviceInfo {
    /// Current number of the camera in the system.
    pub index: u32,
    /// Name given by the driver. Two cameras of the same model have the same name.
    pub name: String,
}

/// Lists the connected cameras in the order of their numbers. The list is empty if there are none or the system does
/// not report them.
///
/// Takes a few milliseconds. Cameras that another program uses are listed too.
pub fn list_devices() -> Vec<DeviceInfo> {
    let mut devices = catch_unwind(source::list).unwrap_or_default();
    devices.sort_by_key(|device| device.index);
    devices
}

/// Returns the camera with the given identification. A camera that was found before (`known`) is found again by its
/// name; if several cameras have that name, the one with the old number is preferred.
pub(super) fn find<'a>(devices: &'a [DeviceInfo], id: &DeviceId, known: Option<&DeviceInfo>) -> Option<&'a DeviceInfo> {
    if let Some(known) = known {
        let same_name = || devices.iter().filter(|device| device.name == known.name);
        return same_name().find(|device| device.index == known.index).or_else(|| same_name().next());
    }
    match id {
        DeviceId::First => devices.first(),
        DeviceId::Index(index) => devices.iter().find(|device| device.index == *index),
        DeviceId::Name(name) => devices.iter().find(|device| device.name == *name).or_else(|| {
            let name = name.to_lowercase();
            devices.iter().find(|device| device.name.to_lowercase().contains(&name))
        }),
    }
}

/// Returns a message that the camera is missing, with a list of the connected ones.
pub(super) fn missing(devices: &[DeviceInfo], id: &DeviceId, known: Option<&DeviceInfo>) -> String {
    let wanted = match (known, id) {
        (Some(known), _) => format!("the camera \"{}\" is gone", known.name),
        (None, DeviceId::First) => "there is no camera".to_owned(),
        (None, DeviceId::Index(index)) => format!("there is no camera number {index}"),
        (None, DeviceId::Name(name)) => format!("there is no camera called \"{name}\""),
    };
    if devices.is_empty() {
        return format!("{wanted}. Connect it; it is found by itself");
    }
    let others: Vec<_> = devices.iter().map(|device| format!("{} \"{}\"", device.index, device.name)).collect();
    format!("{wanted}. Connect it, it is found by itself, or take another: {}", others.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(index: u32, name: &str) -> DeviceInfo {
        DeviceInfo { index, name: name.to_owned() }
    }

    #[test]
    fn a_camera_is_found_by_number_or_name_and_an_exact_name_comes_first() {
        let devices = [device(0, "Big Cam 2"), device(2, "Big Cam"), device(4, "Other")];
        let index_of = |id: DeviceId| find(&devices, &id, None).map(|device| device.index);
        assert_eq!(index_of(DeviceId::First), Some(0));
        assert_eq!(index_of(DeviceId::Index(4)), Some(4));
        assert_eq!(index_of(DeviceId::Index(1)), None);
        assert_eq!(index_of(DeviceId::Name("Big Cam".into())), Some(2));
        assert_eq!(index_of(DeviceId::Name("big cam".into())), Some(0));
        assert_eq!(index_of(DeviceId::Name("third".into())), None);
    }

    #[test]
    fn a_camera_that_was_known_is_found_by_its_name_at_another_number_and_not_mistaken_for_its_successor() {
        let known = device(0, "Mine");
        let id = DeviceId::Index(0);
        assert_eq!(find(&[device(0, "Other"), device(1, "Mine")], &id, Some(&known)), Some(&device(1, "Mine")));
        assert_eq!(find(&[device(0, "Other")], &id, Some(&known)), None);
        assert_eq!(find(&[device(1, "Mine"), device(0, "Mine")], &id, Some(&device(0, "Mine"))), Some(&known));
        assert!(missing(&[device(0, "Other")], &id, Some(&known)).contains("\"Mine\" is gone"));
    }

    #[test]
    fn wishes_that_are_none_become_the_defaults() {
        let odd = DeviceOptions { size: Some(UVec2::ZERO), frame_rate: Some(f32::NAN), ..default() };
        assert_eq!(odd.wished_size(), UVec2::ONE);
        assert_eq!(odd.wished_frame_rate(), 30.0);
        assert_eq!(DeviceOptions::default().wished_size(), UVec2::new(640, 480));
    }
}
