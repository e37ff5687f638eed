//! Events of feeds that are interrupted and resume, and run conditions on them.

use super::{CameraFeed, FeedState};
use bevy::prelude::*;

/// Event that a feed stops delivering frames. Triggered on the camera with the [`CameraFeed`], once, in the update in
/// which its [`FeedState`] becomes [`Lost`](FeedState::Lost) or [`Failed`](FeedState::Failed), and once more if a lost
/// feed fails. The last good frame stays. A feed that fails before its first frame counts too; other reasons for the
/// same state trigger nothing.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{camera::{FeedLost, FeedRecovered}, prelude::*};
/// # fn setup(mut commands: Commands) {
/// commands
///     .spawn((ArCamera::default(), CameraFeed::clip("assets/desk_clip")))
///     .observe(|lost: On<FeedLost>, mut time: ResMut<Time<Virtual>>| {
///         warn!("the game waits: {}", lost.reason);
///         time.pause();
///     })
///     .observe(|_: On<FeedRecovered>, mut time: ResMut<Time<Virtual>>| time.unpause());
/// # }
/// ```
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[reflect(Event, Debug, Clone, PartialEq)]
pub struct FeedLost {
    /// Entity of the camera.
    pub entity: Entity,
    /// Reason and remedy, as in the [`FeedState`].
    pub reason: String,
    /// Whether the feed resumes by itself when its source is back. If not, it needs a new [`CameraFeed`].
    pub resumes: bool,
}

/// Event that frames arrive again after [`FeedLost`]. Triggered on the camera with the [`CameraFeed`], in the update in
/// which its [`FeedState`] becomes [`Playing`](FeedState::Playing), also if another feed has taken the place of the
/// lost one. The first frames of a feed trigger nothing. There is an example at [`FeedLost`].
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Event, Debug, Clone, PartialEq)]
pub struct FeedRecovered {
    /// Entity of the camera.
    pub entity: Entity,
}

/// The newest event of a feed.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq)]
pub(crate) enum ReportedFeed {
    /// None, or [`FeedRecovered`].
    #[default]
    Fine,
    /// [`FeedLost`], and whether the feed resumes.
    Lost { resumes: bool },
}

type ChangedState = (Entity, &'static FeedState, &'static mut ReportedFeed);

/// Triggers an event for each feed that is interrupted or resumes.
pub(super) fn report_feeds(
    mut commands: Commands,
    mut feeds: Query<ChangedState, (Changed<FeedState>, With<CameraFeed>)>,
) {
    for (entity, state, mut reported) in &mut feeds {
        let (reason, resumes) = match state {
            FeedState::Waiting => continue,
            FeedState::Playing => {
                if *reported != ReportedFeed::Fine {
                    *reported = ReportedFeed::Fine;
                    commands.trigger(FeedRecovered { entity });
                }
                continue;
            }
            FeedState::Lost(reason) => (reason.clone(), true),
            FeedState::Failed(reason) => (reason.clone(), false),
        };
        let lost = ReportedFeed::Lost { resumes };
        if *reported != lost {
            *reported = lost;
            commands.trigger(FeedLost { entity, reason, resumes });
        }
    }
}

impl FeedState {
    /// Why no frames arrive, if the feed is lost or has failed.
    pub fn problem(&self) -> Option<&str> {
        match self {
            Self::Waiting | Self::Playing => None,
            Self::Lost(reason) | Self::Failed(reason) => Some(reason),
        }
    }
}

/// Run condition: at least one [`CameraFeed`] is [`Lost`](FeedState::Lost) or has [`Failed`](FeedState::Failed).
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::camera::any_feed_lost;
/// # fn blink_camera_symbol() {}
/// # let mut app = App::new();
/// app.add_systems(Update, blink_camera_symbol.run_if(any_feed_lost));
/// ```
pub fn any_feed_lost(feeds: Query<&FeedState, With<CameraFeed>>) -> bool {
    feeds.iter().any(|state| state.problem().is_some())
}
