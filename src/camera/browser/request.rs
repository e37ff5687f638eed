//! Asks the browser for a camera, and what it knows about cameras.

use super::{
    BrowserCameraOptions, CameraFacing,
    bindings::{name_and_message, object, property},
    failure::{Failure, Surroundings},
};
use js_sys::{Array, Object};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{
    MediaDeviceInfo, MediaDeviceKind, MediaDevices, MediaStream, MediaStreamConstraints, MediaStreamTrack,
    PermissionState, PermissionStatus,
};

/// A stream whose tracks are stopped when it is dropped, so that the light of the camera goes off.
pub(super) struct OwnedStream(pub(super) MediaStream);

impl OwnedStream {
    /// The track of the camera. Streams of a camera have exactly one.
    pub(super) fn track(&self) -> Option<MediaStreamTrack> {
        self.0.get_video_tracks().get(0).dyn_into().ok()
    }
}

impl Drop for OwnedStream {
    fn drop(&mut self) {
        for track in self.0.get_tracks().iter() {
            track.unchecked_into::<MediaStreamTrack>().stop();
        }
    }
}

/// Asks for a camera, which may show the user a dialog and takes as long as the user does.
pub(super) async fn request(options: &BrowserCameraOptions) -> Result<OwnedStream, Failure> {
    let devices = media_devices()?;
    let constraints = MediaStreamConstraints::new();
    constraints.set_audio(&false.into());
    constraints.set_video(&track_constraints(options));
    let failure = |error: JsValue| {
        let (name, message) = name_and_message(&error);
        Failure::of_request(&name, &message, options.wished_device())
    };
    let promise = devices.get_user_media_with_constraints(&constraints).map_err(failure)?;
    let stream = JsFuture::from(promise).await.map_err(failure)?;
    Ok(OwnedStream(stream.unchecked_into()))
}

/// What the camera shall do, all of it wishes but the id.
pub(super) fn track_constraints(options: &BrowserCameraOptions) -> Object {
    let ideal = |value: JsValue| JsValue::from(object(&[("ideal", value)]));
    let size = options.wished_size();
    let mut wishes = vec![
        ("width", ideal(size.x.into())),
        ("height", ideal(size.y.into())),
        // The camera's own pixels: cut ones would have another field of view, and scaled ones are less sharp.
        ("resizeMode", ideal("none".into())),
    ];
    if let Some(rate) = options.wished_frame_rate() {
        wishes.push(("frameRate", ideal(rate.into())));
    }
    wishes.push(match options.wished_device() {
        Some(id) => ("deviceId", object(&[("exact", id.into())]).into()),
        None => {
            let facing = match options.facing {
                CameraFacing::Environment => "environment",
                CameraFacing::User => "user",
            };
            ("facingMode", ideal(facing.into()))
        }
    });
    object(&wishes)
}

/// Asks the browser what it knows about cameras. Shows no dialog.
pub(super) async fn look_around() -> Surroundings {
    Surroundings { is_permitted: is_permitted().await, cameras: cameras().await.unwrap_or_default() }
}

fn media_devices() -> Result<MediaDevices, Failure> {
    let window = web_sys::window().ok_or(Failure::NoPage)?;
    let devices = window.navigator().media_devices();
    // An insecure page has an undefined value here, which `web-sys` passes on as it is.
    match devices.ok().filter(|devices| !devices.is_undefined() && !devices.is_null()) {
        Some(devices) => Ok(devices),
        None if window.is_secure_context() => Err(Failure::NoCameraApi),
        None => Err(Failure::Insecure),
    }
}

async fn is_permitted() -> Option<bool> {
    let permissions = web_sys::window()?.navigator().permissions().ok()?;
    if permissions.is_undefined() {
        return None;
    }
    // Browsers that do not know this name reject it.
    let promise = permissions.query(&object(&[("name", "camera".into())])).ok()?;
    let status: PermissionStatus = JsFuture::from(promise).await.ok()?.dyn_into().ok()?;
    Some(status.state() == PermissionState::Granted)
}

async fn cameras() -> Option<Vec<String>> {
    let promise = media_devices().ok()?.enumerate_devices().ok()?;
    let list: Array = JsFuture::from(promise).await.ok()?.dyn_into().ok()?;
    let devices = list.iter().filter_map(|device| device.dyn_into::<MediaDeviceInfo>().ok());
    let cameras = devices.filter(|device| device.kind() == MediaDeviceKind::Videoinput);
    Some(cameras.map(|camera| camera.device_id()).collect())
}

/// Frames per second that a track delivers, if the browser tells it.
pub(super) fn frame_rate(track: &MediaStreamTrack) -> Option<f64> {
    let rate = property(&track.get_settings(), "frameRate").as_f64()?;
    (rate.is_finite() && rate > 0.0).then_some(rate)
}
