//! What the players have reached.

use super::{Edge, GOLD, PALE, entry, panel};
use crate::{
    game::{MenuAction, Player, Screen, Song},
    hud::{status::color, text},
    rules::Grade,
};
use bevy::prelude::*;

pub(in crate::hud) fn show_results(mut commands: Commands, song: Option<Res<Song>>, players: Query<&Player>) {
    let mut players: Vec<_> = players.iter().collect();
    players.sort_by_key(|player| player.number);
    commands.spawn((panel(Edge::Bottom), DespawnOnExit(Screen::Results))).with_children(|panel| {
        let difficulty = players.first().map_or("", |player| player.chart.difficulty.name());
        let title = song.map_or_else(String::new, |song| song.file.title.clone());
        panel.spawn(text(4.5, GOLD, format!("{title}   {difficulty}")));
        let columns = Node { column_gap: vmin(14.0), ..default() };
        panel.spawn(columns).with_children(|columns| {
            for player in &players {
                let column =
                    Node { flex_direction: FlexDirection::Column, align_items: AlignItems::Center, ..default() };
                columns.spawn(column).with_children(|column| write_tally(column, player, players.len()));
            }
        });
        panel.spawn(text(3.6, Color::WHITE, winner(&players)));
        entry(panel, 3.6, "on (Enter)", MenuAction::Back);
    });
}

fn write_tally(column: &mut ChildSpawnerCommands, player: &Player, players: usize) {
    let tally = &player.tally;
    if players > 1 {
        column.spawn(text(3.6, PALE, format!("player {}", player.number + 1)));
    }
    column.spawn(text(12.0, GOLD, tally.letter().name()));
    column.spawn(text(6.0, Color::WHITE, tally.score_text()));
    for grade in Grade::ALL {
        column.spawn(text(3.6, color(grade), format!("{:<9} {:>4}", grade.name(), tally.hits(grade))));
    }
    let (held, let_go) = tally.holds();
    if held + let_go > 0 {
        column.spawn(text(3.6, Color::WHITE, format!("{:<9} {:>4}", "Holds", format!("{held}/{}", held + let_go))));
    }
    column.spawn(text(3.6, Color::WHITE, format!("{:<9} {:>4}", "Combo", tally.best_combo())));
}

/// Says which of two players has danced better.
fn winner(players: &[&Player]) -> String {
    let [one, two] = players else {
        return String::new();
    };
    let difference = one.tally.score() - two.tally.score();
    if difference == 0.0 {
        return "a draw".to_owned();
    }
    let winner = if difference > 0.0 { one } else { two };
    format!("player {} wins by {:.2} %", winner.number + 1, 100.0 * difference.abs())
}
