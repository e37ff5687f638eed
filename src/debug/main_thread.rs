//! Time that the stages of this crate take of an update.

use super::MAIN_THREAD;
use crate::MirrorballSystems;
use bevy::{diagnostic::Diagnostics, platform::time::Instant, prelude::*};
use std::time::Duration;

/// Time spent in this update so far.
#[derive(Resource, Default)]
struct UpdateClock {
    started: Option<Instant>,
    spent: Duration,
}

/// Measures from the first to the last stage, in `PreUpdate` and in `PostUpdate` after transforms are propagated.
pub(super) fn build(app: &mut App) {
    use MirrorballSystems::{Follow, Measure, Poll, Shade};
    app.init_resource::<UpdateClock>().add_systems(PreUpdate, (start.before(Poll), stop.after(Follow))).add_systems(
        PostUpdate,
        (start.before(Measure).after(TransformSystems::Propagate), (stop, publish).chain().after(Shade)),
    );
}

fn start(mut clock: ResMut<UpdateClock>) {
    clock.started = Some(Instant::now());
}

fn stop(mut clock: ResMut<UpdateClock>) {
    if let Some(started) = clock.started.take() {
        clock.spent += started.elapsed();
    }
}

fn publish(mut clock: ResMut<UpdateClock>, mut diagnostics: Diagnostics) {
    let spent = std::mem::take(&mut clock.spent);
    diagnostics.add_measurement(&MAIN_THREAD, || 1e3 * spent.as_secs_f64());
}
