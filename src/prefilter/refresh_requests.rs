//! Requests to filter environments again.

use super::{
    filtered_environment::FilteredEnvironment,
    refresh::{EnvironmentState, Refresh},
};
use bevy::{camera::RenderTarget, prelude::*};

/// Requests the maps that are due from the render world, and reports the age of maps to the game.
pub(super) fn request_refreshes(
    mut environments: Query<(&FilteredEnvironment, &mut EnvironmentState)>,
    mut changes: MessageReader<AssetEvent<Image>>,
    cameras: Query<(&Camera, &RenderTarget)>,
) {
    for change in changes.read() {
        if let AssetEvent::Modified { id } = change {
            let changed = environments.iter().filter(|(maps, _)| maps.source.id() == *id);
            changed.filter(|(maps, _)| maps.refresh == Refresh::OnChange).for_each(|(maps, _)| maps.request_refresh());
        }
    }
    for (maps, mut state) in &mut environments {
        let is_rendered = |(camera, target): (&Camera, &RenderTarget)| {
            camera.is_active && target.as_image().is_some_and(|image| *image == maps.source)
        };
        let is_due = match maps.refresh {
            Refresh::EveryFrame | Refresh::Budget { .. } => true,
            Refresh::OnChange => cameras.iter().any(is_rendered),
            Refresh::OnRequest => false,
        };
        if is_due {
            maps.request_refresh();
        }
        if let EnvironmentState::Live { refreshes, frames_since_refresh } = state.as_mut() {
            let finished = maps.progress.finished();
            *frames_since_refresh = if finished == *refreshes { frames_since_refresh.saturating_add(1) } else { 0 };
            *refreshes = finished;
        }
    }
}
