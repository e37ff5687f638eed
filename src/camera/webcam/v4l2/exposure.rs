//! Exposure time of a V4L2 camera.

use super::errors::{describe, title};
use crate::camera::webcam::devices::{DeviceExposure, DeviceInfo, DeviceOptions};
use bevy::prelude::*;
use std::io;
use v4l::{
    Device,
    control::{Control, Value},
};

// Camera class controls, V4L2 "Camera Control Reference".
const EXPOSURE_AUTO: u32 = 0x009a_0901;
const EXPOSURE_TIME: u32 = 0x009a_0902;
const MANUAL: i64 = 1;
const AUTOMATIC: i64 = 0;
const APERTURE_PRIORITY: i64 = 3;
/// Unit of the exposure time: 100 µs.
const UNITS_PER_SECOND: f32 = 10_000.0;

/// The exposures that a camera uses, in units of its control; the usual one comes first. Empty if the camera keeps its
/// own.
#[derive(Default)]
pub(super) struct Exposures(Vec<i64>);

impl Exposures {
    /// The usual exposure time in seconds.
    pub(super) fn seconds(&self) -> Option<f32> {
        self.0.first().map(|units| *units as f32 / UNITS_PER_SECOND)
    }

    /// The shorter exposures, as fractions of the usual one.
    pub(super) fn shorter(&self) -> Vec<f32> {
        let fraction = |units: &i64| *units as f32 / self.0[0] as f32;
        self.0.iter().skip(1).map(fraction).collect()
    }

    /// Changes the camera to one of the exposures.
    pub(super) fn set(&self, device: &Device, info: &DeviceInfo, step: usize) -> Result<(), String> {
        let Some(&value) = self.0.get(step) else {
            return Ok(());
        };
        let failed = |error: io::Error| describe(info, "does not change its exposure any more", &error);
        set(device, EXPOSURE_TIME, value).map_err(failed)
    }
}

fn set(device: &Device, id: u32, value: i64) -> io::Result<()> {
    device.set_control(Control { id, value: Value::Integer(value) })
}

/// Sets an exposure time and asks what the camera made of it, both in its units.
fn set_time(device: &Device, units: i64) -> io::Result<i64> {
    set(device, EXPOSURE_TIME, units)?;
    match device.control(EXPOSURE_TIME)?.value {
        Value::Integer(units) if units > 0 => Ok(units),
        other => Err(io::Error::other(format!("it answers {other:?}"))),
    }
}

/// Tries the shorter exposures, then sets the usual one, and returns the values that the camera accepted.
pub(super) fn expose(device: &Device, info: &DeviceInfo, options: &DeviceOptions) -> Exposures {
    let DeviceOptions { exposure, shorter_exposures, .. } = options;
    let title = title(info);
    let refused = |error: io::Error| {
        warn!("{title} does not take the exposure {exposure:?} ({error}): it keeps its own; measured light may change");
    };
    let mut exposures = Exposures::default();
    match exposure {
        DeviceExposure::Unchanged => {}
        // Webcams have a fixed aperture and support only one of the two modes.
        DeviceExposure::Automatic => {
            let switched =
                set(device, EXPOSURE_AUTO, APERTURE_PRIORITY).or_else(|_| set(device, EXPOSURE_AUTO, AUTOMATIC));
            let _ = switched.map_err(refused);
        }
        DeviceExposure::Seconds(seconds) => {
            // Cameras without automatic exposure lack this control.
            let _ = set(device, EXPOSURE_AUTO, MANUAL);
            let units = (UNITS_PER_SECOND * seconds).round().clamp(1.0, i32::MAX as f32) as i64;
            exposures.0.extend(set_time(device, units).map_err(refused).ok());
        }
    }
    if shorter_exposures.is_empty() {
        return exposures;
    }
    let Some(&usual) = exposures.0.first() else {
        warn!("{title} takes no shorter exposures: its usual one has to be DeviceExposure::Seconds");
        return exposures;
    };
    for fraction in shorter_exposures {
        let units = ((usual as f32 * fraction).round() as i64).max(1);
        let taken = if *fraction > 0.0 && *fraction < 1.0 {
            set_time(device, units)
        } else {
            Err(io::Error::other("no fraction"))
        };
        match taken {
            Ok(units) if units < usual => exposures.0.push(units),
            Ok(_) => warn!("{title} cannot take {fraction} of its exposure; give a longer usual one"),
            Err(error) => {
                warn!("{title} does not take {fraction} of its exposure ({error}); give a number above 0 and below 1");
            }
        }
    }
    exposures.0[1..].sort_unstable_by(|a, b| b.cmp(a));
    exposures.0.dedup();
    if let Err(error) = set_time(device, usual) {
        refused(error);
        return Exposures::default();
    }
    exposures
}
