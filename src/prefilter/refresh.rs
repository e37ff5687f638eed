//! When maps are made anew.

use bevy::prelude::*;
use std::sync::{
    Arc,
    atomic::{AtomicU32, Ordering},
};

/// When a [`LiveEnvironment`](super::LiveEnvironment) is filtered.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub enum Refresh {
    /// Every frame: for sources that other GPU passes write without telling. The default.
    #[default]
    EveryFrame,
    /// When the source changes: its [`Image`] asset was modified, a camera renders into it, or the pass that wrote it said so
    /// in [`CubeWrites`](crate::environment_map::CubeWrites). Otherwise it costs nothing on the GPU.
    OnChange,
    /// Once, and then when [`FilteredEnvironment::request_refresh`](super::FilteredEnvironment::request_refresh) is called.
    OnRequest,
    /// All the time, but with at most this many dispatches a frame (1 and above; 0 counts as 1); reading the source counts
    /// as one and is done within one frame, then each glossy level and the diffuse map are one each. The maps that light the
    /// scene change only when a whole set is finished, so that a set never mixes moments. Bounds the work of a frame, not its
    /// time: with 1, the sharp glossy level remains the longest dispatch.
    Budget {
        /// Dispatches a frame.
        dispatches: u32,
    },
}

/// How far the lighting by a [`LiveEnvironment`](super::LiveEnvironment) is, on the same entity. Read it; written each frame.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub enum EnvironmentState {
    /// The source is still loading, or there is no such image.
    #[default]
    Waiting,
    /// The source cannot be used; the text names the field, what is wrong and what helps. Also logged, once.
    Refused(String),
    /// The maps light the scene.
    Live {
        /// Complete sets of maps made so far; 0 until shaders are compiled.
        refreshes: u32,
        /// Frames since the last of them was finished.
        frames_since_refresh: u32,
    },
}

/// Requests of the main world and answers of the render world.
#[derive(Default, Debug)]
struct Counters {
    requested: AtomicU32,
    finished: AtomicU32,
}

/// Shared by everything that uses the same maps.
#[derive(Clone, Default, Debug)]
pub(super) struct Progress(Arc<Counters>);

impl Progress {
    pub(super) fn request(&self) {
        self.0.requested.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn requested(&self) -> u32 {
        self.0.requested.load(Ordering::Relaxed)
    }

    pub(super) fn finish(&self) {
        self.0.finished.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn finished(&self) -> u32 {
        self.0.finished.load(Ordering::Relaxed)
    }
}
