//! Events of markers that come and go, and run conditions on them.

use super::{MarkerId, MarkerState, MarkerTracking, WorldOrigin};
use bevy::prelude::*;

/// Event that a marker is tracked after it was not: for the first time, or again after it was lost. Triggered on the
/// entity of its [`MarkerAnchor`](super::MarkerAnchor), once, in the update in which [`MarkerTracking::state`] becomes
/// [`Tracked`](MarkerState::Tracked) and after camera and anchors have moved.
///
/// A marker that is [`Held`](MarkerState::Held) for a moment was not lost, so its return triggers nothing.
/// [`PoseFilter::found_after`](super::PoseFilter::found_after) delays the event of a marker that has just appeared.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, tracking::{MarkerFound, MarkerLost}};
/// # fn setup(mut commands: Commands) {
/// // A figure that is there while the marker of its anchor is.
/// commands
///     .spawn((MarkerAnchor::new(7, 0.04), Visibility::Hidden))
///     .observe(|found: On<MarkerFound>, mut figures: Query<&mut Visibility>| -> Result {
///         *figures.get_mut(found.entity)? = Visibility::Inherited;
///         Ok(())
///     })
///     .observe(|lost: On<MarkerLost>, mut figures: Query<&mut Visibility>| -> Result {
///         *figures.get_mut(lost.entity)? = Visibility::Hidden;
///         Ok(())
///     });
/// // All markers.
/// commands.add_observer(|found: On<MarkerFound>| info!("{} is at {}", found.marker, found.entity));
/// # }
/// ```
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Event, Debug, Clone, PartialEq)]
pub struct MarkerFound {
    /// Entity of the anchor.
    pub entity: Entity,
    /// Marker of the anchor. On a [`MarkerBoard`](super::MarkerBoard), another marker may be the one in the frame.
    pub marker: MarkerId,
    /// Camera that tracks the marker, as [`MarkerTracking::camera`].
    pub camera: Option<Entity>,
}

/// Event that a marker is no longer tracked. Triggered on the entity of its [`MarkerAnchor`](super::MarkerAnchor),
/// once, in the update in which [`MarkerTracking::state`] becomes [`Lost`](MarkerState::Lost): no camera has seen the
/// marker for longer than [`PoseFilter::lost_after`](super::PoseFilter::lost_after). Everything keeps its last pose.
/// Until then the marker is [`Held`](MarkerState::Held), which triggers nothing. There is an example at
/// [`MarkerFound`].
///
/// It is also triggered when tracking forgets its past, as it does when a
/// [`FrameRecorder`](super::FrameRecorder) is added to the camera. Removed anchors trigger nothing.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Event, Debug, Clone, PartialEq)]
pub struct MarkerLost {
    /// Entity of the anchor.
    pub entity: Entity,
    /// Marker of the anchor.
    pub marker: MarkerId,
}

/// Whether the newest event of an anchor was [`MarkerFound`].
#[derive(Component, Clone, Copy, Debug, Default)]
pub(crate) struct ReportedFound(bool);

type ChangedMarker = (Entity, &'static super::MarkerAnchor, &'static MarkerTracking, &'static mut ReportedFound);

/// Triggers an event for each marker that has come or gone.
pub(super) fn report_markers(mut commands: Commands, mut markers: Query<ChangedMarker, Changed<MarkerTracking>>) {
    for (entity, anchor, tracking, mut reported) in &mut markers {
        let is_found = tracking.state.is_found();
        if is_found == reported.0 {
            continue;
        }
        reported.0 = is_found;
        let marker = anchor.marker();
        if is_found {
            commands.trigger(MarkerFound { entity, marker, camera: tracking.camera });
        } else {
            commands.trigger(MarkerLost { entity, marker });
        }
    }
}

impl MarkerState {
    /// Whether the marker is tracked, or held for a moment: between [`MarkerFound`] and [`MarkerLost`].
    pub fn is_found(self) -> bool {
        matches!(self, Self::Tracked | Self::Held)
    }
}

/// Run condition: at least one marker is tracked or held, so that its pose is known.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::tracking::any_marker_tracked;
/// # fn play_music() {}
/// # fn search_music() {}
/// # let mut app = App::new();
/// app.add_systems(Update, (play_music.run_if(any_marker_tracked), search_music.run_if(not(any_marker_tracked))));
/// ```
pub fn any_marker_tracked(markers: Query<&MarkerTracking>) -> bool {
    markers.iter().any(|tracking| tracking.state.is_found())
}

/// Run condition: the marker of the anchor with [`WorldOrigin`] is tracked or held, so that the pose of a camera is
/// known. `false` without such an anchor.
pub fn world_origin_tracked(origins: Query<&MarkerTracking, With<WorldOrigin>>) -> bool {
    origins.iter().any(|tracking| tracking.state.is_found())
}
