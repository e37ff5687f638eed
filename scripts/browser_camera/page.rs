//! Functions with which the test page drives the camera.

use crate::browser::{BrowserCamera, BrowserCameraOptions, BrowserStatus, CameraFacing};
use glam::UVec2;
use js_sys::{Array, Uint8Array};
use wasm_bindgen::prelude::*;

/// A camera under test.
#[wasm_bindgen]
pub struct Cam(BrowserCamera);

#[wasm_bindgen]
impl Cam {
    /// Opens a camera.
    #[wasm_bindgen(constructor)]
    pub fn new(width: u32, height: u32, device_id: Option<String>, frame_rate: Option<f32>, locks: bool) -> Self {
        Self(BrowserCamera::open(BrowserCameraOptions {
            facing: CameraFacing::Environment,
            device_id,
            size: UVec2::new(width, height),
            frame_rate,
            locks_exposure: locks,
            locks_white_balance: locks,
        }))
    }

    /// Status as text.
    pub fn status(&self) -> String {
        match self.0.status() {
            BrowserStatus::Opening => "opening".to_owned(),
            BrowserStatus::Playing { size, label } => format!("playing {}x{} {label}", size.x, size.y),
            BrowserStatus::Lost(reason) => format!("lost: {reason}"),
        }
    }

    /// Newest frame: width, height, age and reading time in milliseconds, dropped, bytes.
    pub fn take(&self) -> Option<Array> {
        let frame = self.0.take()?;
        let numbers = [
            f64::from(frame.size.x),
            f64::from(frame.size.y),
            1000.0 * frame.age.as_secs_f64(),
            1000.0 * frame.read_time.as_secs_f64(),
            frame.dropped as f64,
        ];
        let result: Array = numbers.into_iter().map(JsValue::from).collect();
        result.push(&Uint8Array::from(&frame.rgba[..]));
        Some(result)
    }

    /// Notice about locks, as text.
    pub fn notice(&self) -> String {
        format!("{:?}", self.0.take_notice())
    }
}
