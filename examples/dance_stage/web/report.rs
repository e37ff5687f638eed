//! What the page is told, as attributes of its root element, so that it shows it and tests read it:
//!
//! | attribute | |
//! |---|---|
//! | `data-stage` | `loading`, `lit` or `failed` |
//! | `data-feed` | `waiting`, `playing`, `lost` or `failed` |
//! | `data-reason` | why it failed or is lost, in words |
//! | `data-marker` | `searching`, `tracked`, … as [`MarkerTracking`] says |
//! | `data-shape` | `upright` once the frames are taller than wide, `across` when they are no more |
//! | `data-things` | a list of `["name", is_toon]` in the order of the keys 1 to 9 |

use super::{is_lit, still::Still};
use crate::stage;
use bevy::prelude::*;
use bevy_mirrorball::{camera::FeedState, prefilter::EnvironmentState, prelude::*, tracking::MarkerTracking};

/// Sets an attribute of the page's root element.
pub(super) fn tell(name: &str, value: &str) {
    let root = web_sys::window().and_then(|window| window.document()?.document_element());
    if let Some(root) = root {
        // It fails for names that are none.
        let _ = root.set_attribute(&format!("data-{name}"), value);
    }
}

/// Tells the page what is new.
pub(super) fn report(
    mut told: Local<[String; 5]>,
    still: Option<Res<Still>>,
    feeds: Query<&FeedState>,
    environments: Query<&EnvironmentState, With<ArCamera>>,
    markers: Query<&MarkerTracking>,
    styles: Query<(&Name, &SurfaceStyle)>,
) {
    let state = feeds.iter().next().cloned().unwrap_or_default();
    let is_shown = still.is_none_or(|still| still.is_shown());
    let stage = match &state {
        FeedState::Failed(_) => "failed",
        _ if is_shown && environments.iter().any(is_lit) => "lit",
        _ => "loading",
    };
    let (feed, reason) = match state {
        FeedState::Waiting => ("waiting", String::new()),
        FeedState::Playing => ("playing", String::new()),
        FeedState::Lost(reason) => ("lost", reason),
        FeedState::Failed(reason) => ("failed", reason),
        _ => ("", String::new()),
    };
    let marker = markers.iter().next().map(|marker| format!("{:?}", marker.state).to_lowercase()).unwrap_or_default();
    let mut things: Vec<_> = styles.iter().map(|(name, style)| (name.as_str(), *style == stage::toon())).collect();
    things.sort_unstable();
    let things = serde_json::to_string(&things).unwrap_or_default();
    // The stage comes last: who waits for it finds the rest.
    let names = ["feed", "reason", "marker", "things", "stage"];
    let news = [feed.to_owned(), reason, marker, things, stage.to_owned()];
    for ((name, new), told) in names.into_iter().zip(news).zip(told.iter_mut()) {
        if *told != new {
            tell(name, &new);
            *told = new;
        }
    }
}
