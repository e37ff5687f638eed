//! The life of a camera: asking, running, lost, asking again.
//!
//! Everything goes on in the game's updates ([`update`]), in the browser's callbacks for frames, and in tasks that wait
//! for the browser. They meet in a [`Session`] that belongs to the handle alone: what finds it gone stops.

use super::{
    BrowserCameraOptions, BrowserStatus,
    bindings::{FrameMetadata, name_and_message},
    failure::{Failure, Surroundings, browser_says},
    locks::lock,
    mean_color::mean_color,
    newest_frame::{NewestFrame, ReadFrame, page_time},
    read_pixels::{FrameCopy, Reading},
    request::{OwnedStream, look_around, request},
    stream::Stream,
};
use std::{
    cell::RefCell,
    rc::{Rc, Weak},
    time::Duration,
};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::MediaStreamTrack;

/// Time between two looks for a lost camera.
const LOOK_INTERVAL: Duration = Duration::from_secs(1);
/// Time that exposure and white balance get to settle before they are locked.
const SETTLING_TIME: Duration = Duration::from_secs(1);

/// A camera and what has become of it.
pub(super) struct Session {
    options: BrowserCameraOptions,
    phase: Phase,
    pub(super) newest: NewestFrame,
    /// What became of the locks, once: which there are, or as an error which are missing.
    pub(super) notice: Option<Result<String, String>>,
    streams: u32,
}

enum Phase {
    Asking,
    Running(Box<Stream>),
    Lost {
        failure: Failure,
        /// What the browser told when the camera was lost.
        before: Option<Surroundings>,
        next_look: Duration,
        is_looking: bool,
    },
}

pub(super) type Shared = Rc<RefCell<Session>>;

/// Starts a session, which asks the browser for the camera.
pub(super) fn start(options: BrowserCameraOptions) -> Shared {
    let newest = NewestFrame::default();
    let session = Session { options, phase: Phase::Asking, newest, notice: None, streams: 0 };
    let session = Rc::new(RefCell::new(session));
    ask(&session);
    session
}

/// Milliseconds of the page's clock.
pub(super) fn now_ms() -> f64 {
    web_sys::window().and_then(|window| window.performance()).map_or(0.0, |performance| performance.now())
}

/// Does what is due. To be called in each update of the game.
pub(super) fn update(session: &Shared) {
    let now = page_time(now_ms());
    let mut this = session.borrow_mut();
    let options = this.options.clone();
    match &mut this.phase {
        Phase::Asking => {}
        Phase::Running(stream) if stream.has_ended() => {
            let failure = Failure::Ended(stream.label.clone());
            this.phase = Phase::Lost { failure, before: None, next_look: now, is_looking: false };
        }
        Phase::Running(stream) => {
            stream.silence.look(now);
            if let Some(promise) = stream.play(now) {
                spawn_local(await_play(Rc::downgrade(session), promise));
            }
            let is_settled = stream.playing.is_some_and(|(_, first)| now.saturating_sub(first) >= SETTLING_TIME);
            if is_settled && !stream.is_locking && (options.locks_exposure || options.locks_white_balance) {
                stream.is_locking = true;
                // Not `track.clone()`, which is the browser's: a second track, which would keep the camera on.
                let (track, number) = (Clone::clone(&stream.track), stream.number);
                spawn_local(await_locks(Rc::downgrade(session), number, track, options));
            }
            if stream.finds_frame(now) {
                this.read_frame(session, now);
            }
        }
        Phase::Lost { next_look, is_looking, .. } if !*is_looking && now >= *next_look => {
            *is_looking = true;
            spawn_local(look(Rc::downgrade(session)));
        }
        Phase::Lost { .. } => {}
    }
}

/// Asks the browser for the camera.
fn ask(session: &Shared) {
    let (weak, options) = (Rc::downgrade(session), session.borrow().options.clone());
    spawn_local(async move {
        let result = request(&options).await;
        let around = if result.is_err() { Some(look_around().await) } else { None };
        // A session that is gone drops the stream, which switches the camera off.
        let Some(session) = weak.upgrade() else { return };
        let shown = result.and_then(|owned| show(&session, owned));
        let mut session = session.borrow_mut();
        session.phase = match shown {
            Ok(stream) => Phase::Running(Box::new(stream)),
            Err(failure) => {
                let next_look = page_time(now_ms()) + LOOK_INTERVAL;
                Phase::Lost { failure, before: around, next_look, is_looking: false }
            }
        };
    });
}

/// Shows a stream, and has each frame of it read.
fn show(session: &Shared, owned: OwnedStream) -> Result<Stream, Failure> {
    let mut this = session.borrow_mut();
    this.streams += 1;
    let weak = Rc::downgrade(session);
    let callback = Closure::new(move |_time: f64, metadata: JsValue| {
        if let Some(session) = weak.upgrade() {
            frame_came(&session, metadata.unchecked_ref());
        }
    });
    Stream::show(this.streams, owned, callback).map_err(|error| {
        let (name, message) = name_and_message(&error);
        Failure::Other(format!("{name} {message}").trim().to_owned())
    })
}

/// Looks whether it makes sense to ask again for a lost camera.
async fn look(weak: Weak<RefCell<Session>>) {
    let around = look_around().await;
    let Some(session) = weak.upgrade() else { return };
    let mut this = session.borrow_mut();
    let Phase::Lost { failure, before, next_look, is_looking } = &mut this.phase else { return };
    *is_looking = false;
    *next_look = page_time(now_ms()) + LOOK_INTERVAL;
    // Cameras that are unplugged from now on count as new when they come back.
    let before = before.replace(around.clone());
    if failure.asks_again(before.as_ref().unwrap_or(&around), &around) {
        // Stays lost, with its reason, until the browser has answered.
        *is_looking = true;
        drop(this);
        ask(&session);
    }
}

async fn await_play(weak: Weak<RefCell<Session>>, promise: js_sys::Promise) {
    let result = JsFuture::from(promise).await;
    let Some(session) = weak.upgrade() else { return };
    if let Phase::Running(stream) = &mut session.borrow_mut().phase {
        stream.play_error = result.err().map(|error| name_and_message(&error).1);
    }
}

async fn await_locks(
    weak: Weak<RefCell<Session>>,
    number: u32,
    track: MediaStreamTrack,
    options: BrowserCameraOptions,
) {
    let color = || match &weak.upgrade()?.borrow().phase {
        Phase::Running(stream) if stream.number == number => Some(stream.color),
        _ => None,
    };
    let locks = lock(&track, &options, color).await;
    let Some(session) = weak.upgrade() else { return };
    let this = &mut *session.borrow_mut();
    if let Phase::Running(stream) = &mut this.phase
        && stream.number == number
    {
        this.notice = locks.notice(&stream.label);
    }
}

/// A callback of the browser: there is a new frame.
fn frame_came(session: &Shared, metadata: &FrameMetadata) {
    let mut this = session.borrow_mut();
    let now = now_ms();
    let Phase::Running(stream) = &mut this.phase else { return };
    let captured = stream.called_back(metadata, now);
    stream.await_frame();
    if let Some(number) = metadata.presented_frames() {
        this.newest.note_presented(number);
    }
    this.read_frame(session, captured);
}

/// Waits for a frame that the browser copies.
async fn finish_copy(weak: Weak<RefCell<Session>>, number: u32, copy: FrameCopy, captured: Duration, started: f64) {
    let result = copy.finish().await;
    let Some(session) = weak.upgrade() else { return };
    let mut this = session.borrow_mut();
    let Phase::Running(stream) = &mut this.phase else { return };
    if stream.number != number {
        return;
    }
    stream.reader.copy_ended(result.is_ok());
    match result {
        Ok((size, rgba)) => {
            let read_time = page_time(now_ms() - started);
            this.frame_read(ReadFrame { size, rgba, captured, read_time });
        }
        Err(_) => this.newest.drop_one(),
    }
}

impl Session {
    /// Begins to read the frame that the video shows now.
    fn read_frame(&mut self, shared: &Shared, captured: Duration) {
        let started = now_ms();
        let Phase::Running(stream) = &mut self.phase else { return };
        let video = stream.video().clone();
        match stream.reader.read(&video) {
            Ok(Reading::Finished(size, rgba)) => {
                let read_time = page_time(now_ms() - started);
                self.frame_read(ReadFrame { size, rgba, captured, read_time });
            }
            Ok(Reading::Copying(copy)) => {
                spawn_local(finish_copy(Rc::downgrade(shared), stream.number, copy, captured, started));
            }
            Ok(Reading::Busy) | Err(_) => self.newest.drop_one(),
        }
    }

    fn frame_read(&mut self, frame: ReadFrame) {
        if let Phase::Running(stream) = &mut self.phase {
            stream.silence.frame_arrived();
            stream.color = mean_color(&frame.rgba);
            let first = stream.playing.map_or_else(|| page_time(now_ms()), |(_, first)| first);
            stream.playing = Some((frame.size, first));
        }
        self.newest.put(frame);
    }

    pub(super) fn status(&self) -> BrowserStatus {
        let stream = match &self.phase {
            Phase::Asking => return BrowserStatus::Opening,
            Phase::Lost { failure, .. } => return BrowserStatus::Lost(failure.to_string()),
            Phase::Running(stream) => stream,
        };
        let name = &stream.label;
        match (stream.silence.exceeded(), stream.playing) {
            _ if stream.track.muted() => BrowserStatus::Lost(format!(
                "the system holds back the picture of the camera \"{name}\". Open its cover or switch, end calls and \
                 other programs that use it; it goes on by itself"
            )),
            (Some(silence), _) => BrowserStatus::Lost(match &stream.play_error {
                Some(error) => format!(
                    "the browser does not play the picture of the camera \"{name}\"{}. Tap or click the page, or allow \
                     it to play videos by itself",
                    browser_says(error)
                ),
                None => format!(
                    "no picture from the camera \"{name}\" for {} s. If this stays, reload the page, or unplug the \
                     camera and plug it in again",
                    silence.as_secs()
                ),
            }),
            (None, None) => BrowserStatus::Opening,
            (None, Some((size, _))) => BrowserStatus::Playing { size, label: name.clone() },
        }
    }
}
