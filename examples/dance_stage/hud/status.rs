//! Life, score, combo and verdict of a player.

use super::{Shows, text};
use crate::{
    game::{Playback, Player},
    rules::Grade,
};
use bevy::prelude::*;

/// Time for which a verdict is shown, in seconds.
const VERDICT_SECONDS: f64 = 0.6;
/// Smallest combo that is shown.
const MIN_COMBO: u32 = 4;

#[derive(Component)]
pub(super) struct LifeFill;
#[derive(Component)]
pub(super) struct ScoreText;
#[derive(Component)]
pub(super) struct VerdictText;
#[derive(Component)]
pub(super) struct ComboText;
#[derive(Component)]
pub(super) struct PauseText;

pub(super) fn spawn(side: &mut EntityCommands, player: Entity) {
    let line = |top: Val, bottom: Val| Node {
        position_type: PositionType::Absolute,
        top,
        bottom,
        width: percent(100),
        justify_content: JustifyContent::Center,
        ..default()
    };
    side.with_children(|side| {
        let frame = Node {
            position_type: PositionType::Absolute,
            top: vmin(1.5),
            left: vmin(1.5),
            right: vmin(1.5),
            height: vmin(2.6),
            border: UiRect::all(vmin(0.3)),
            border_radius: BorderRadius::all(vmin(1.3)),
            ..default()
        };
        side.spawn((frame, BorderColor::all(Color::WHITE), BackgroundColor(Color::srgba(0.0, 0.0, 0.0, 0.6))))
            .with_child((
                Node { height: percent(100), border_radius: BorderRadius::all(vmin(1.0)), ..default() },
                BackgroundColor::default(),
                LifeFill,
                Shows(player),
            ));
        let words = |size: f32| (text(size, Color::WHITE, ""), Shows(player));
        side.spawn(line(vmin(40.0), Val::Auto)).with_child((words(7.0), VerdictText));
        side.spawn(line(vmin(48.0), Val::Auto)).with_child((words(4.5), ComboText));
        side.spawn(line(vmin(58.0), Val::Auto)).with_child((words(6.0), PauseText));
        side.spawn(line(Val::Auto, vmin(2.0))).with_child((words(5.5), ScoreText));
    });
}

/// Color of a grade.
pub(super) fn color(grade: Grade) -> Color {
    match grade {
        Grade::Marvelous => Color::srgb(0.85, 1.0, 1.0),
        Grade::Perfect => Color::srgb(1.0, 0.85, 0.3),
        Grade::Great => Color::srgb(0.4, 1.0, 0.45),
        Grade::Good => Color::srgb(0.4, 0.7, 1.0),
        Grade::Almost => Color::srgb(0.85, 0.5, 1.0),
        Grade::Miss => Color::srgb(1.0, 0.35, 0.3),
    }
}

pub(super) fn fill_life(
    players: Query<&Player>,
    mut fills: Query<(&Shows, &mut Node, &mut BackgroundColor), With<LifeFill>>,
) {
    for (shows, mut node, mut background) in &mut fills {
        let Ok(player) = players.get(shows.0) else { continue };
        let life = player.tally.life();
        node.set_if_neq(Node { width: percent(100.0 * life), ..node.clone() });
        let color = Color::srgb(1.0 - 0.75 * life, 0.25 + 0.65 * life, 0.35);
        background.set_if_neq(BackgroundColor(color));
    }
}

pub(super) fn write_score(players: Query<&Player>, mut texts: Query<(&Shows, &mut Text), With<ScoreText>>) {
    for (shows, mut text) in &mut texts {
        let Ok(player) = players.get(shows.0) else { continue };
        set(&mut text, || player.tally.score_text());
    }
}

pub(super) fn write_verdict(
    playback: Res<Playback>,
    players: Query<&Player>,
    mut texts: Query<(&Shows, &mut Text, &mut TextColor, &mut UiTransform), With<VerdictText>>,
) {
    for (shows, mut text, mut text_color, mut transform) in &mut texts {
        let Ok(player) = players.get(shows.0) else { continue };
        let hit = player.latest.filter(|hit| playback.now - hit.seconds < VERDICT_SECONDS);
        set(&mut text, || hit.map_or_else(String::new, |hit| hit.grade.name().to_owned()));
        if let Some(hit) = hit {
            let age = ((playback.now - hit.seconds) / VERDICT_SECONDS).clamp(0.0, 1.0) as f32;
            let swell = 1.0 + 0.25 * (1.0 - 5.0 * age).max(0.0);
            transform.set_if_neq(UiTransform { scale: Vec2::splat(swell), ..*transform });
            text_color.set_if_neq(TextColor(color(hit.grade)));
        }
    }
}

pub(super) fn write_combo(players: Query<&Player>, mut texts: Query<(&Shows, &mut Text), With<ComboText>>) {
    for (shows, mut text) in &mut texts {
        let Ok(player) = players.get(shows.0) else { continue };
        let combo = player.tally.combo();
        set(&mut text, || match player.tally.has_failed() {
            true => "failed".to_owned(),
            false if combo < MIN_COMBO => String::new(),
            false => format!("{combo} combo"),
        });
    }
}

pub(super) fn write_pause(playback: Res<Playback>, mut texts: Query<&mut Text, With<PauseText>>) {
    for mut text in &mut texts {
        set(&mut text, || if playback.is_paused() { "PAUSE".to_owned() } else { String::new() });
    }
}

/// Writes a text. What stays as it is does not count as changed, and is not laid out anew.
pub(super) fn set(text: &mut Mut<Text>, new: impl FnOnce() -> String) {
    text.set_if_neq(Text(new()));
}
