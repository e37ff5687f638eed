//! Reads the pixels of a video.
//!
//! `VideoFrame.copyTo` converts the camera's frame by itself, four times as fast as a canvas, and does not wait for the
//! graphics processor where frames lie there. A canvas can do it in every browser and turns frames as they are shown.

use super::{
    bindings::{VideoFrame, object},
    options::MAX_SIDE,
};
use glam::UVec2;
use js_sys::{Promise, Uint8Array};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::JsFuture;
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement, HtmlVideoElement};

/// Frames in a row that could not be copied, after which all are drawn.
const MAX_FAILED_COPIES: u32 = 3;

/// Reader of the frames of one video.
#[derive(Default)]
pub(super) struct PixelReader {
    /// Frames in a row that could not be copied.
    failed_copies: u32,
    is_copying: bool,
    /// Takes the bytes of one frame after the other.
    buffer: Option<Uint8Array>,
    canvas: Option<(HtmlCanvasElement, CanvasRenderingContext2d)>,
}

/// A frame that is being read.
pub(super) enum Reading {
    /// It was read.
    Finished(UVec2, Vec<u8>),
    /// The browser reads it in the background.
    Copying(FrameCopy),
    /// The browser still reads the last one. This one is left out.
    Busy,
}

/// A frame that the browser copies.
pub(super) struct FrameCopy {
    size: UVec2,
    bytes: Uint8Array,
    promise: Promise,
    _frame: OpenFrame,
}

/// A frame that is closed when it is dropped. The camera has few buffers and stops when none is free.
struct OpenFrame(VideoFrame);

impl Drop for OpenFrame {
    fn drop(&mut self) {
        self.0.close();
    }
}

impl PixelReader {
    /// Begins to read the frame that the video shows now.
    pub(super) fn read(&mut self, video: &HtmlVideoElement) -> Result<Reading, JsValue> {
        if self.is_copying {
            return Ok(Reading::Busy);
        }
        if self.failed_copies < MAX_FAILED_COPIES {
            if let Some(copy) = self.copy(video) {
                self.is_copying = true;
                return Ok(Reading::Copying(copy));
            }
            self.failed_copies += 1;
        }
        let size = UVec2::new(video.video_width(), video.video_height());
        Ok(Reading::Finished(size, self.draw(video, size)?))
    }

    /// Notes that a copy has ended.
    pub(super) fn copy_ended(&mut self, has_succeeded: bool) {
        self.is_copying = false;
        self.failed_copies = if has_succeeded { 0 } else { self.failed_copies + 1 };
    }

    /// Starts a copy, if the browser can convert the frame and nothing else is to be done with it.
    fn copy(&mut self, video: &HtmlVideoElement) -> Option<FrameCopy> {
        let frame = OpenFrame(VideoFrame::of_video(video).ok()?);
        let rect = frame.0.visible_rect()?;
        let is_upright = frame.0.rotation().is_none_or(|degrees| degrees == 0.0) && frame.0.flip() != Some(true);
        let is_as_shown = (rect.width(), rect.height()) == (frame.0.display_width(), frame.0.display_height());
        let size = UVec2::new(rect.width() as u32, rect.height() as u32);
        let length = byte_length(size)?;
        let options = object(&[("format", "RGBA".into()), ("colorSpace", "srgb".into())]);
        // Browsers that do not convert would write the planes of the camera's own format, which are shorter.
        let is_converted = frame.0.allocation_size(&options).ok()? == f64::from(length);
        if !is_upright || !is_as_shown || !is_converted {
            return None;
        }
        let bytes = self.buffer.take().filter(|buffer| buffer.length() == length);
        let bytes = bytes.unwrap_or_else(|| Uint8Array::new_with_length(length));
        let promise = frame.0.copy_to(&bytes, &options).ok()?;
        self.buffer = Some(bytes.clone());
        Some(FrameCopy { size, bytes, promise, _frame: frame })
    }

    fn draw(&mut self, video: &HtmlVideoElement, size: UVec2) -> Result<Vec<u8>, JsValue> {
        byte_length(size).ok_or("a video without a size that can be used")?;
        let (canvas, context) = match &self.canvas {
            Some(canvas) => canvas,
            None => self.canvas.insert(new_canvas()?),
        };
        if (canvas.width(), canvas.height()) != (size.x, size.y) {
            canvas.set_width(size.x);
            canvas.set_height(size.y);
        }
        let (width, height) = (f64::from(size.x), f64::from(size.y));
        context.draw_image_with_html_video_element_and_dw_and_dh(video, 0.0, 0.0, width, height)?;
        let rgba = context.get_image_data(0.0, 0.0, width, height)?.data().0;
        Ok(rgba)
    }
}

impl FrameCopy {
    /// Waits for the pixels.
    pub(super) async fn finish(self) -> Result<(UVec2, Vec<u8>), JsValue> {
        JsFuture::from(self.promise).await?;
        Ok((self.size, self.bytes.to_vec()))
    }
}

/// Bytes of a frame. `None` for sizes that are empty or too large.
fn byte_length(size: UVec2) -> Option<u32> {
    (size.min_element() > 0 && size.max_element() <= MAX_SIDE).then(|| 4 * size.x * size.y)
}

fn new_canvas() -> Result<(HtmlCanvasElement, CanvasRenderingContext2d), JsValue> {
    let document = web_sys::window().and_then(|window| window.document()).ok_or("no page")?;
    let canvas: HtmlCanvasElement = document.create_element("canvas")?.dyn_into()?;
    let options = object(&[
        ("alpha", false.into()),
        ("colorSpace", "srgb".into()),
        // Keeps the canvas in main memory, where it is read.
        ("willReadFrequently", true.into()),
    ]);
    let context = canvas.get_context_with_context_options("2d", &options)?.ok_or("no canvas")?;
    Ok((canvas, context.dyn_into()?))
}
