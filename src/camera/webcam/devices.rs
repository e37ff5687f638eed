//! Which cameras there are, and what may be asked of one.

use super::source;
use bevy::prelude::*;
use std::panic::catch_unwind;

/// Which camera is meant.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub enum DeviceId {
    /// The first camera that [`list_devices`] finds.
    #[default]
    First,
    /// The number the system gives the camera: 2 is `/dev/video2` on Linux. Numbers change when cameras are plugged in, so
    /// a camera found by its number is known by its name from then on.
    Index(u32),
    /// The camera's name as [`list_devices`] gives it, or a part of it; upper and lower case are the same. A camera with
    /// exactly this name comes first.
    Name(String),
}

/// How long the sensor collects light for one picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum DeviceExposure {
    /// As the camera is set now, by its own default or by another program.
    #[default]
    Unchanged,
    /// The camera chooses, and changes its mind while the game runs: measured light changes with it.
    Automatic,
    /// Seconds of light per picture, for light that is comparable from picture to picture. Webcams do about 0.0001 to 0.5,
    /// in steps of 0.0001, and less than one frame time at the full frame rate; the camera takes the nearest it can.
    ///
    /// Linux only; a camera that refuses keeps its setting, and a warning says so.
    Seconds(f32),
}

/// How pictures travel from the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DeviceEncoding {
    /// As the wished size and rate are met best; uncompressed if that does not matter.
    #[default]
    Any,
    /// As they are: exact colors and corners, but many cameras send large pictures slowly.
    Uncompressed,
    /// As JPEGs: a tenth of the data, for large pictures, long cables and several cameras on one USB bus.
    Jpeg,
}

/// A camera, and what is asked of it. The camera does what it can: the size and rate nearest to the wishes are taken, the
/// size first.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::camera::{DeviceExposure, DeviceId, DeviceOptions};
/// let options = DeviceOptions {
///     device: DeviceId::Name("C920".into()),
///     size: Some(UVec2::new(1280, 720)),
///     exposure: DeviceExposure::Seconds(0.02),
///     // and now and then 2.5 and 0.2 ms, for the lamps
///     shorter_exposures: vec![0.125, 0.01],
///     ..default()
/// };
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeviceOptions {
    /// Which camera. Defaults to the first one.
    pub device: DeviceId,
    /// Wished width and height in pixels; a zero counts as one. Defaults to `None`: 640 × 480.
    pub size: Option<UVec2>,
    /// Wished pictures per second; values that are not positive numbers count as `None`. Defaults to `None`: 30.
    pub frame_rate: Option<f32>,
    /// How pictures travel. A camera that cannot do it sends as it can. Defaults to [`DeviceEncoding::Any`].
    pub encoding: DeviceEncoding,
    /// How long the sensor collects light. Defaults to [`DeviceExposure::Unchanged`].
    pub exposure: DeviceExposure,
    /// Shorter exposures that the camera takes in between, as shares of the usual one, above 0 and below 1, which has to be
    /// [`DeviceExposure::Seconds`]. They show how bright lamps are that the usual one clips
    /// ([`BracketedFrames`](crate::camera::BracketedFrames)) and are not shown. Defaults to none.
    ///
    /// Every two seconds each of them is taken once. Cameras change their exposure some pictures late, so that five pictures for each and
    /// four more are not shown: with one of them at 30 pictures per second the picture stands still for 0.3 s. Turn automatic white balance
    /// and gain off. Under lamps that flicker with the mains (100 or 120 times a second) exposures shorter than a period catch them at
    /// any brightness; such pictures are ignored where the marker's paper shows it by a quarter or more.
    ///
    /// Linux only; elsewhere, or where the camera refuses, a warning says so and all pictures have the usual exposure.
    pub shorter_exposures: Vec<f32>,
}

/// Wished size where the game has none: every webcam has it, and marker detection is fast.
const DEFAULT_SIZE: UVec2 = UVec2::new(640, 480);
/// Wished pictures per second where the game has no wish.
const DEFAULT_FRAME_RATE: f32 = 30.0;

impl From<u32> for DeviceOptions {
    /// The camera with this number, as it likes.
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

/// A camera that is connected.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct DeviceInfo {
    /// The number the system gives it now.
    pub index: u32,
    /// What its driver calls it. Two cameras of the same make have the same name.
    pub name: String,
}

/// The cameras that are connected, in the order of their numbers; empty if there are none or the system does not say.
///
/// Takes a few milliseconds. A camera that another program uses is listed too.
pub fn list_devices() -> Vec<DeviceInfo> {
    let mut devices = catch_unwind(source::list).unwrap_or_default();
    devices.sort_by_key(|device| device.index);
    devices
}

/// The camera that is meant. One that was found before is found again by its name, at its old number if it is there twice.
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

/// Says that the camera that is meant is not there, and which ones are.
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
