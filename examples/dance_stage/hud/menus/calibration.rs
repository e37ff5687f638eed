//! The screen on which players step to a metronome.

use super::{Edge, GOLD, PALE, entry, panel};
use crate::{
    game::{Calibration, Latency, MenuAction, Playback, Screen},
    hud::{status::set, text},
};
use bevy::prelude::*;

/// Line that shows how the calibration goes.
#[derive(Component)]
pub(in crate::hud) struct CalibrationText;

/// Dot that beats with the metronome.
#[derive(Component)]
pub(in crate::hud) struct Metronome;

pub(in crate::hud) fn show_calibration(mut commands: Commands) {
    commands.spawn((panel(Edge::Bottom), DespawnOnExit(Screen::Calibration))).with_children(|panel| {
        let dot = Node { width: vmin(10.0), height: vmin(10.0), border_radius: BorderRadius::MAX, ..default() };
        panel.spawn((dot, BackgroundColor(GOLD), Metronome));
        panel.spawn(text(4.5, Color::WHITE, "step or press a key on each beat"));
        panel.spawn((text(3.6, PALE, ""), CalibrationText));
        entry(panel, 3.6, "back (Enter)", MenuAction::Back);
    });
}

pub(in crate::hud) fn write_calibration(
    calibration: Option<Res<Calibration>>,
    latency: Res<Latency>,
    playback: Option<Res<Playback>>,
    mut texts: Query<&mut Text, With<CalibrationText>>,
    mut dots: Query<&mut BackgroundColor, With<Metronome>>,
) {
    let (Some(calibration), Some(playback)) = (calibration, playback) else {
        return;
    };
    for mut text in &mut texts {
        set(&mut text, || match calibration.outcome {
            Some(Err(error)) => error.to_string(),
            _ => format!("{} more   now: steps count {:.0} ms earlier", calibration.steps_left(), 1000.0 * latency.0),
        });
    }
    for mut dot in &mut dots {
        let glow = (1.0 - 3.0 * playback.beat.rem_euclid(1.0) as f32).max(0.08);
        dot.set_if_neq(BackgroundColor(GOLD.with_alpha(glow)));
    }
}
