//! The handle of a camera, through which the game reads its frames and status.
//!
//! Objects of the browser belong to the thread of the page, and sources of frames may be sent between threads. So the
//! objects stay in a table of their thread, and the handle has nothing but a number.

use super::{
    BrowserCameraOptions,
    newest_frame::{Captured, page_time},
    session::{Shared, now_ms, start, update},
};
use glam::UVec2;
use std::{cell::RefCell, collections::BTreeMap};

/// Status of a camera of the browser.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum BrowserStatus {
    /// The browser has been asked for the camera, or no frame has arrived yet.
    Opening,
    /// Frames arrive.
    Playing {
        /// Width and height of the newest frame in pixels. It changes when a phone is turned.
        size: UVec2,
        /// Name of the camera, as the browser tells it.
        label: String,
    },
    /// No frames arrive. The text says why, and what to do.
    Lost(String),
}

/// A camera of the browser. Dropping it switches the camera off.
#[derive(Debug)]
pub(crate) struct BrowserCamera {
    number: u64,
}

#[derive(Default)]
struct Cameras {
    sessions: BTreeMap<u64, Shared>,
    opened: u64,
}

thread_local! {
    static CAMERAS: RefCell<Cameras> = RefCell::default();
}

/// What a camera says to other threads than the one that has opened it.
const WRONG_THREAD: &str = "the camera belongs to another thread of the page. Poll it in the one that has opened it";

impl BrowserCamera {
    /// Asks the browser for a camera, and returns at once.
    pub(crate) fn open(options: BrowserCameraOptions) -> Self {
        let session = start(options);
        let number = CAMERAS.with_borrow_mut(|cameras| {
            cameras.opened += 1;
            cameras.sessions.insert(cameras.opened, session);
            cameras.opened
        });
        Self { number }
    }

    /// The current status. To be called in each update: it also looks after a camera that is lost.
    pub(crate) fn status(&self) -> BrowserStatus {
        let Some(session) = self.session() else {
            return BrowserStatus::Lost(WRONG_THREAD.to_owned());
        };
        update(&session);
        session.borrow().status()
    }

    /// Takes the newest frame, if one has arrived since the last call.
    pub(crate) fn take(&self) -> Option<Captured> {
        self.session()?.borrow_mut().newest.take(page_time(now_ms()))
    }

    /// Takes what the user should be told once: which locks there are, or as an error which are missing.
    pub(crate) fn take_notice(&self) -> Option<Result<String, String>> {
        self.session()?.borrow_mut().notice.take()
    }

    fn session(&self) -> Option<Shared> {
        CAMERAS.with_borrow(|cameras| cameras.sessions.get(&self.number).cloned())
    }
}

impl Drop for BrowserCamera {
    fn drop(&mut self) {
        // Dropped after the table is free again.
        let session = CAMERAS.try_with(|cameras| cameras.try_borrow_mut().ok()?.sessions.remove(&self.number));
        drop(session);
    }
}
