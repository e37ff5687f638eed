//! A stream of the camera that runs: the video that shows it, and the frames that arrive.

use super::{
    bindings::{CallingVideo, FrameMetadata},
    newest_frame::{capture_time, page_time},
    read_pixels::PixelReader,
    request::{OwnedStream, frame_rate},
    silence_clock::SilenceClock,
};
use glam::UVec2;
use std::time::Duration;
use wasm_bindgen::prelude::*;
use web_sys::{HtmlMediaElement, HtmlVideoElement, MediaStreamTrack, MediaStreamTrackState};

/// Frames per second of cameras that do not tell them.
const USUAL_FRAME_RATE: f64 = 30.0;
/// Fraction of a frame's duration after which the next one may be there.
const MIN_FRAME: f64 = 0.75;
/// Longest wait for the first callback before the video is looked at in each update instead. Versions of Safari do not
/// call back for videos that the page does not show (pull request 36896 of `WebKit`).
const MAX_CALLBACK_SILENCE: Duration = Duration::from_millis(500);

/// A camera that runs. Dropping it switches the camera off.
pub(super) struct Stream {
    /// Number of the stream in its session. What belongs to an earlier one comes too late.
    pub(super) number: u32,
    pub(super) track: MediaStreamTrack,
    pub(super) label: String,
    pub(super) reader: PixelReader,
    pub(super) silence: SilenceClock,
    /// Size of the newest frame and the time of the first.
    pub(super) playing: Option<(UVec2, Duration)>,
    /// Mean color of the newest frame.
    pub(super) color: [f32; 3],
    /// Whether the locks were asked for.
    pub(super) is_locking: bool,
    /// Why the browser does not play the video, in its words.
    pub(super) play_error: Option<String>,
    /// When to tell a paused video again to play.
    pub(super) next_play: Duration,
    video: CallingVideo,
    callback: FrameCallback,
    handle: Option<u32>,
    has_called_back: bool,
    /// The last frame that was found without a callback, and the time then.
    found: Option<(Position, Duration)>,
    _owned: OwnedStream,
}

/// Where a video is: the number of frames that it has got, 0 in browsers that do not count those of cameras, and its
/// time in seconds.
type Position = (u32, f64);

/// Called by the browser with the time and [`FrameMetadata`].
pub(super) type FrameCallback = Closure<dyn FnMut(f64, JsValue)>;

impl Stream {
    /// Shows a stream in a video that is in no page. `callback` is called for each frame.
    pub(super) fn show(number: u32, owned: OwnedStream, callback: FrameCallback) -> Result<Self, JsValue> {
        let track = owned.track().ok_or("the stream has no picture")?;
        let document = web_sys::window().and_then(|window| window.document()).ok_or("no page")?;
        let video: HtmlVideoElement = document.create_element("video")?.dyn_into()?;
        // As attributes too: Safari on phones plays nothing inside the page without them.
        for attribute in ["muted", "playsinline", "autoplay"] {
            video.set_attribute(attribute, "")?;
        }
        video.set_muted(true);
        video.set_src_object(Some(&owned.0));
        let mut stream = Self {
            number,
            label: track.label(),
            track,
            reader: PixelReader::default(),
            silence: SilenceClock::default(),
            playing: None,
            color: [0.0; 3],
            is_locking: false,
            play_error: None,
            next_play: Duration::ZERO,
            video: video.unchecked_into(),
            callback,
            handle: None,
            has_called_back: false,
            found: None,
            _owned: owned,
        };
        stream.await_frame();
        Ok(stream)
    }

    /// Asks the browser to call back when the next frame is there, if it can.
    pub(super) fn await_frame(&mut self) {
        self.handle = None;
        if self.video.frame_callback_function().is_function() {
            self.handle = self.video.request_frame_callback(self.callback.as_ref().unchecked_ref()).ok();
        }
    }

    pub(super) fn video(&self) -> &HtmlVideoElement {
        &self.video
    }

    /// Notes a callback at `now`, and returns when the frame was captured.
    pub(super) fn called_back(&mut self, metadata: &FrameMetadata, now: f64) -> Duration {
        self.has_called_back = true;
        page_time(capture_time(now, metadata.capture_time(), metadata.presentation_time()))
    }

    /// Whether the video shows a new frame in a browser that does not call back.
    pub(super) fn finds_frame(&mut self, now: Duration) -> bool {
        if self.has_called_back || self.video.ready_state() < HtmlMediaElement::HAVE_CURRENT_DATA {
            return false;
        }
        let frames = self.video.get_video_playback_quality().total_video_frames();
        let position = (frames, self.video.current_time());
        let wait = match (self.found, self.handle) {
            (None, Some(_)) => {
                self.found = Some((position, now));
                return false;
            }
            (None, None) => Duration::ZERO,
            (Some(_), Some(_)) if self.playing.is_none() => MAX_CALLBACK_SILENCE,
            (Some(_), _) if frames > 0 => Duration::ZERO,
            // The time runs on between two frames in some browsers.
            (Some(_), _) => {
                Duration::from_secs_f64(MIN_FRAME / frame_rate(&self.track).unwrap_or(USUAL_FRAME_RATE).max(1.0))
            }
        };
        let is_new = |(last, since): (Position, Duration)| {
            let has_advanced = if frames > 0 { frames != last.0 } else { position.1 != last.1 };
            has_advanced && now.saturating_sub(since) >= wait
        };
        if !self.found.is_none_or(is_new) {
            return false;
        }
        self.found = Some((position, now));
        true
    }

    /// Whether the track has ended: the camera was unplugged, or is no longer permitted.
    pub(super) fn has_ended(&self) -> bool {
        self.track.ready_state() == MediaStreamTrackState::Ended
    }

    /// Tells the video to play if it does not; not more often than once per second.
    pub(super) fn play(&mut self, now: Duration) -> Option<js_sys::Promise> {
        if !self.video.paused() || now < self.next_play {
            return None;
        }
        self.next_play = now + Duration::from_secs(1);
        self.video.play().ok()
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        if let Some(handle) = self.handle.take() {
            _ = self.video.cancel_frame_callback(handle);
        }
        self.video.set_src_object(None);
    }
}
