//! What keys, buttons and the mouse do.

use super::{Edge, GOLD, PALE, entry, panel};
use crate::{
    game::{MenuAction, Screen},
    hud::text,
};
use bevy::prelude::*;

const LINES: [(&str, &str); 10] = [
    ("step", "arrow keys, WASD; D-pad and buttons; dance mat"),
    ("two players", "WASD and arrow keys; first and second gamepad"),
    ("menus", "arrows, Enter, Esc; D-pad, Start, Select; mouse"),
    ("pause", "Space; Start"),
    ("leave a dance", "Esc; Select"),
    ("toon or not", "1-9 one thing, T all of them"),
    ("style of a thing", "click it"),
    ("lights of the stage", "L"),
    ("measuring panel", "Tab or F1"),
    ("full screen", "F11"),
];

pub(in crate::hud) fn show_help(mut commands: Commands) {
    commands.spawn((panel(Edge::Bottom), DespawnOnExit(Screen::Help))).with_children(|panel| {
        panel.spawn(text(3.8, GOLD, "step when an arrow reaches its target"));
        let grid = Node {
            display: Display::Grid,
            grid_template_columns: RepeatedGridTrack::auto(2),
            column_gap: vmin(3.0),
            row_gap: vmin(0.5),
            ..default()
        };
        panel.spawn(grid).with_children(|grid| {
            for (what, how) in LINES {
                grid.spawn(text(2.8, Color::WHITE, what));
                grid.spawn(text(2.8, PALE, how));
            }
        });
        entry(panel, 3.6, "back (Enter)", MenuAction::Back);
    });
}
