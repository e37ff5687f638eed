//! How long a V4L2 camera collects light.

use super::errors::title;
use crate::camera::webcam::devices::{DeviceExposure, DeviceInfo};
use bevy::prelude::*;
use std::io;
use v4l::{
    Device,
    control::{Control, Value},
};

/// Sets the exposure and returns what the camera made of it, in seconds.
pub(super) fn expose(device: &Device, info: &DeviceInfo, exposure: DeviceExposure) -> Option<f32> {
    // Camera class controls, V4L2 "Camera Control Reference".
    const AUTO: u32 = 0x009a_0901;
    const TIME: u32 = 0x009a_0902;
    const MANUAL: i64 = 1;
    const AUTOMATIC: i64 = 0;
    const APERTURE_PRIORITY: i64 = 3;
    /// Unit of the exposure time: 100 µs.
    const PER_SECOND: f32 = 10_000.0;
    let set = |id, value| device.set_control(Control { id, value: Value::Integer(value) });
    let refused = |error: io::Error| {
        let title = title(info);
        warn!("{title} does not take the exposure {exposure:?} ({error}): it keeps its own; measured light may change");
    };
    match exposure {
        DeviceExposure::Unchanged => None,
        // Webcams have a fixed aperture and know only one of the two.
        DeviceExposure::Automatic => {
            set(AUTO, APERTURE_PRIORITY).or_else(|_| set(AUTO, AUTOMATIC)).map_err(refused).ok()?;
            None
        }
        DeviceExposure::Seconds(seconds) => {
            // Cameras without an automatic have no such switch.
            let _ = set(AUTO, MANUAL);
            let units = (PER_SECOND * seconds).round().clamp(1.0, i32::MAX as f32) as i64;
            set(TIME, units).and_then(|()| device.control(TIME)).map_err(refused).ok().and_then(|control| {
                let Value::Integer(units) = control.value else {
                    return None;
                };
                Some(units as f32 / PER_SECOND)
            })
        }
    }
}
