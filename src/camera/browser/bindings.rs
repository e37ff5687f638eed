//! Parts of the browser that `web-sys` has only with a compiler flag of its own, or not at all.

use js_sys::{Function, Object, Promise, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::{DomRectReadOnly, HtmlVideoElement};

#[wasm_bindgen]
extern "C" {
    /// A video element with `requestVideoFrameCallback`, which a community group of the W3C has specified.
    #[wasm_bindgen(extends = HtmlVideoElement)]
    pub(super) type CallingVideo;

    /// The function itself, to see whether the browser has it.
    #[wasm_bindgen(method, structural, getter, js_name = requestVideoFrameCallback)]
    pub(super) fn frame_callback_function(this: &CallingVideo) -> JsValue;

    /// Calls back once, with the time and [`FrameMetadata`], when the next frame is presented.
    #[wasm_bindgen(method, structural, catch, js_name = requestVideoFrameCallback)]
    pub(super) fn request_frame_callback(this: &CallingVideo, callback: &Function) -> Result<u32, JsValue>;

    /// Withdraws a request.
    #[wasm_bindgen(method, structural, catch, js_name = cancelVideoFrameCallback)]
    pub(super) fn cancel_frame_callback(this: &CallingVideo, handle: u32) -> Result<(), JsValue>;

    /// What the browser tells about a frame that it presents. Times are those of `performance.now()`.
    #[wasm_bindgen(extends = Object)]
    pub(super) type FrameMetadata;

    #[wasm_bindgen(method, structural, getter, js_name = captureTime)]
    pub(super) fn capture_time(this: &FrameMetadata) -> Option<f64>;

    #[wasm_bindgen(method, structural, getter, js_name = presentationTime)]
    pub(super) fn presentation_time(this: &FrameMetadata) -> Option<f64>;

    #[wasm_bindgen(method, structural, getter, js_name = presentedFrames)]
    pub(super) fn presented_frames(this: &FrameMetadata) -> Option<u32>;

    /// A frame of the W3C's `WebCodecs`. It holds a buffer of the camera until it is closed.
    #[wasm_bindgen(extends = Object)]
    pub(super) type VideoFrame;

    /// The frame that a video shows now.
    #[wasm_bindgen(constructor, catch)]
    pub(super) fn of_video(video: &HtmlVideoElement) -> Result<VideoFrame, JsValue>;

    /// Part of the pixels that is shown.
    #[wasm_bindgen(method, structural, getter, js_name = visibleRect)]
    pub(super) fn visible_rect(this: &VideoFrame) -> Option<DomRectReadOnly>;

    #[wasm_bindgen(method, structural, getter, js_name = displayWidth)]
    pub(super) fn display_width(this: &VideoFrame) -> f64;

    #[wasm_bindgen(method, structural, getter, js_name = displayHeight)]
    pub(super) fn display_height(this: &VideoFrame) -> f64;

    /// Degrees by which the pixels still have to be turned, in browsers that tell it.
    #[wasm_bindgen(method, structural, getter)]
    pub(super) fn rotation(this: &VideoFrame) -> Option<f64>;

    /// Whether the pixels still have to be mirrored, in browsers that tell it.
    #[wasm_bindgen(method, structural, getter)]
    pub(super) fn flip(this: &VideoFrame) -> Option<bool>;

    /// Bytes that [`copy_to`](VideoFrame::copy_to) writes.
    #[wasm_bindgen(method, structural, catch, js_name = allocationSize)]
    pub(super) fn allocation_size(this: &VideoFrame, options: &Object) -> Result<f64, JsValue>;

    #[wasm_bindgen(method, structural, catch, js_name = copyTo)]
    pub(super) fn copy_to(this: &VideoFrame, bytes: &Uint8Array, options: &Object) -> Result<Promise, JsValue>;

    #[wasm_bindgen(method, structural)]
    pub(super) fn close(this: &VideoFrame);
}

/// A plain object with these properties.
pub(super) fn object(properties: &[(&str, JsValue)]) -> Object {
    let object = Object::new();
    for (name, value) in properties {
        // A new plain object takes every property.
        _ = js_sys::Reflect::set(&object, &(*name).into(), value);
    }
    object
}

/// A property; undefined if there is none.
pub(super) fn property(of: &JsValue, name: &str) -> JsValue {
    js_sys::Reflect::get(of, &name.into()).unwrap_or(JsValue::UNDEFINED)
}

/// Name and message of an error of the browser; empty ones for what is none. A text is a message.
pub(super) fn name_and_message(error: &JsValue) -> (String, String) {
    let text = |name| property(error, name).as_string().unwrap_or_default();
    (text("name"), error.as_string().unwrap_or_else(|| text("message")))
}
