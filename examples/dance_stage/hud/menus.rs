//! The screens before and after a dance.

use super::{
    status::{color, set},
    text,
};
use crate::{
    game::{Calibration, Choice, Latency, Playback, Player, Screen, Song},
    rules::Grade,
};
use bevy::prelude::*;

/// Line of the title that shows what is chosen.
#[derive(Component)]
pub(super) struct ChoiceText;

const PALE: Color = Color::srgb(0.8, 0.85, 0.9);
const GOLD: Color = Color::srgb(1.0, 0.85, 0.4);

/// Where a panel is in the picture.
enum Edge {
    Top,
    Bottom,
}

/// A panel over the whole width of the picture.
fn panel(edge: Edge) -> impl Bundle {
    let (top, bottom) = match edge {
        Edge::Top => (Val::ZERO, Val::Auto),
        Edge::Bottom => (Val::Auto, Val::ZERO),
    };
    let node = Node {
        position_type: PositionType::Absolute,
        top,
        bottom,
        width: percent(100),
        flex_direction: FlexDirection::Column,
        align_items: AlignItems::Center,
        padding: UiRect::axes(Val::ZERO, vmin(1.5)),
        row_gap: vmin(0.6),
        ..default()
    };
    (node, BackgroundColor(Color::srgba(0.02, 0.02, 0.05, 0.6)))
}

pub(super) fn show_title(mut commands: Commands, song: Option<Res<Song>>) {
    let (title, artist) = song.map_or_else(default, |song| (song.file.title.clone(), song.file.artist.clone()));
    commands.spawn((panel(Edge::Top), DespawnOnExit(Screen::Title))).with_children(|panel| {
        panel.spawn(text(8.0, GOLD, title));
        panel.spawn(text(3.2, PALE, artist));
    });
    commands.spawn((panel(Edge::Bottom), DespawnOnExit(Screen::Title))).with_children(|panel| {
        panel.spawn((text(5.0, Color::WHITE, ""), ChoiceText));
        panel.spawn(text(3.2, Color::WHITE, "Enter: dance"));
        panel.spawn(text(3.0, PALE, "arrows: difficulty, players   D: demo   C: set the timing"));
        panel.spawn(text(3.0, PALE, "1-9, T: toon or not   click: style   Tab: panel   Esc: end"));
    });
}

pub(super) fn write_choice(choice: Res<Choice>, mut texts: Query<&mut Text, With<ChoiceText>>) {
    for mut text in &mut texts {
        let players = match (choice.is_demo, choice.players) {
            (true, 1) => "demo",
            (true, _) => "demo of two",
            (false, 1) => "one player",
            _ => "two players (WASD, arrows)",
        };
        set(&mut text, || format!("< {} >   {players}", choice.difficulty.name()));
    }
}

/// Line that shows how the calibration goes.
#[derive(Component)]
pub(super) struct CalibrationText;

/// Dot that beats with the metronome.
#[derive(Component)]
pub(super) struct Metronome;

pub(super) fn show_calibration(mut commands: Commands) {
    commands.spawn((panel(Edge::Bottom), DespawnOnExit(Screen::Calibration))).with_children(|panel| {
        let dot = Node { width: vmin(10.0), height: vmin(10.0), border_radius: BorderRadius::MAX, ..default() };
        panel.spawn((dot, BackgroundColor(GOLD), Metronome));
        panel.spawn(text(4.5, Color::WHITE, "press any key on each beat"));
        panel.spawn((text(3.6, PALE, ""), CalibrationText));
        panel.spawn(text(3.4, PALE, "Enter: back"));
    });
}

pub(super) fn write_calibration(
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

pub(super) fn show_results(mut commands: Commands, song: Option<Res<Song>>, players: Query<&Player>) {
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
        panel.spawn(text(3.4, PALE, "Enter: on"));
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
