//! Settings of the filter of poses.

use bevy::prelude::*;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Smoothing of the poses of a [`MarkerAnchor`](super::MarkerAnchor), and how long it takes to find and to lose it; on
/// the entity of the anchor.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # use bevy_mirrorball::tracking::{FilterUse, PoseFilter};
/// # fn setup(mut commands: Commands) {
/// // As measured, even from a webcam.
/// let raw = PoseFilter { filter: FilterUse::Never, ..default() };
/// commands.spawn((MarkerAnchor::new(0, 0.10), raw));
/// // Stiller and slower than by default.
/// commands.spawn((MarkerAnchor::new(7, 0.04), PoseFilter { min_cutoff: 0.4, ..default() }));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[serde(default)]
pub struct PoseFilter {
    /// Feeds whose poses are filtered. Defaults to live ones.
    pub filter: FilterUse,
    /// Cutoff frequency at rest, in Hz, above 0. The lower, the stiller, and the slower small movements are followed.
    /// Defaults to 1.
    pub min_cutoff: f32,
    /// Rise of the cutoff frequency with the speed, in Hz per radian per second, at least 0. The higher, the less fast
    /// movements lag. Defaults to 25.
    pub speed_gain: f32,
    /// Cutoff frequency of the speed, in Hz, above 0. Defaults to 1.
    pub speed_cutoff: f32,
    /// Difference in radians (for positions: as a fraction of the distance from the camera) from which a pose is taken
    /// as it is measured. Above 0. Defaults to 0.06, which is 3.4°.
    pub jump: f32,
    /// Time for which a marker has to be detected until it counts as found. Defaults to 0.
    pub found_after: Duration,
    /// Time for which a marker that is not detected keeps its place as [`Held`](super::MarkerState::Held), until it
    /// counts as lost. Defaults to 0.5 s.
    pub lost_after: Duration,
    /// Whether what is placed by the marker is moved on from the time of capture to the moment of the update, by its
    /// filtered speed and for at most 0.1 s. For displays that do not show the camera frame, such as projectors: behind
    /// a frame it would make things swim. Defaults to `false`.
    pub predict: bool,
}

impl Default for PoseFilter {
    fn default() -> Self {
        Self {
            filter: FilterUse::default(),
            min_cutoff: 1.0,
            speed_gain: 25.0,
            speed_cutoff: 1.0,
            jump: 0.06,
            found_after: Duration::ZERO,
            lost_after: Duration::from_millis(500),
            predict: false,
        }
    }
}

/// Feeds whose poses a [`PoseFilter`] filters.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum FilterUse {
    /// Webcams, images of the game that change, and recordings of them. Clips, files and frames of the game stay as
    /// they are measured.
    #[default]
    Live,
    /// All feeds.
    Always,
    /// None.
    Never,
}

impl PoseFilter {
    /// Whether poses are smoothed in the frames of a feed.
    pub(super) fn applies_to(&self, is_live: bool) -> bool {
        match self.filter {
            FilterUse::Live => is_live,
            FilterUse::Always => true,
            FilterUse::Never => false,
        }
    }
}
