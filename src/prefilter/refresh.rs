//! Refresh policy and state of environments.

use bevy::prelude::*;
use std::sync::{
    Arc,
    atomic::{AtomicU32, Ordering},
};

/// Refresh policy: when a [`LiveEnvironment`](super::LiveEnvironment) is filtered.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Refresh {
    /// Every frame, for sources that other GPU passes write without announcing it. The default.
    #[default]
    EveryFrame,
    /// When the source changes: its [`Image`] asset was modified, a camera renders into it, or the pass that wrote it
    /// announced that in [`CubeWrites`](crate::environment_map::CubeWrites). Costs nothing on the GPU otherwise.
    OnChange,
    /// Once, and then when [`FilteredEnvironment::request_refresh`](super::FilteredEnvironment::request_refresh) is
    /// called.
    OnRequest,
    /// Continuously, with a limited number of dispatches per frame. Reading the source counts as one dispatch and
    /// happens within one frame; the diffuse map and each specular level follow as one or more dispatches each.
    ///
    /// The maps that light the scene change only when a whole set is finished, so that a set never mixes moments. The
    /// budget limits the work of a frame, not its time: with 1, the sharp specular level remains the longest
    /// dispatch.
    Budget {
        /// Maximum number of dispatches per frame, 1 and above; 0 counts as 1.
        dispatches: u32,
    },
}

/// State of the lighting by a [`LiveEnvironment`](super::LiveEnvironment), on the same entity. Read-only: it is
/// written each frame.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prefilter::EnvironmentState;
/// fn report(states: Query<&EnvironmentState, Changed<EnvironmentState>>) {
///     for state in &states {
///         if let EnvironmentState::Failed(reason) = state {
///             warn!("{reason}");
///         }
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum EnvironmentState {
    /// The source is still loading, or its image does not exist.
    #[default]
    Waiting,
    /// The source cannot be used. The text names the field, the problem and a remedy; it is also logged once.
    Failed(String),
    /// The maps light the scene.
    Live {
        /// Number of complete sets of maps made so far; 0 until the shaders are compiled.
        refreshes: u32,
        /// Frames since the last set was finished.
        frames_since_refresh: u32,
    },
}

impl EnvironmentState {
    /// Old name of [`EnvironmentState::Failed`].
    #[deprecated(since = "0.1.0", note = "use `EnvironmentState::Failed`")]
    #[doc(hidden)]
    #[expect(non_snake_case, reason = "the name that the variant had")]
    pub fn Refused(reason: String) -> Self {
        Self::Failed(reason)
    }
}

/// Counters of requests of the main world and of sets finished by the render world.
#[derive(Default, Debug)]
struct Counters {
    requested: AtomicU32,
    finished: AtomicU32,
}

/// Progress of one set of maps, shared by the two worlds and by all environments with these maps.
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
