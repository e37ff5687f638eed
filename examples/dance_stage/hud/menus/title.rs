//! The title: what is danced to, and how.

use super::{Edge, GOLD, PALE, entry, panel, row};
use crate::{
    game::{Choice, MenuAction, Screen, Song},
    hud::{status::set, text},
};
use bevy::prelude::*;

/// Text that shows a part of what is chosen.
#[derive(Component, Clone, Copy)]
pub(in crate::hud) enum ChoiceText {
    Difficulty,
    Players,
    Demo,
}

pub(in crate::hud) fn show_title(mut commands: Commands, song: Option<Res<Song>>) {
    let (title, artist) = song.map_or_else(default, |song| (song.file.title.clone(), song.file.artist.clone()));
    commands.spawn((panel(Edge::Top), DespawnOnExit(Screen::Title))).with_children(|panel| {
        panel.spawn(text(8.0, GOLD, title));
        panel.spawn(text(3.2, PALE, artist));
    });
    commands.spawn((panel(Edge::Bottom), DespawnOnExit(Screen::Title))).with_children(|panel| {
        row(panel, |row| {
            entry(row, 4.5, "<", MenuAction::Easier);
            row.spawn((text(5.0, Color::WHITE, ""), ChoiceText::Difficulty));
            entry(row, 4.5, ">", MenuAction::Harder);
            entry(row, 3.6, "", MenuAction::SwitchPlayers).insert(ChoiceText::Players);
            entry(row, 3.6, "", MenuAction::SwitchDemo).insert(ChoiceText::Demo);
        });
        entry(panel, 5.5, "dance (Enter)", MenuAction::Start);
        row(panel, |row| {
            for (words, action) in [
                ("timing (C)", MenuAction::SetTiming),
                ("help (H)", MenuAction::ShowHelp),
                ("full screen (F11)", MenuAction::SwitchFullScreen),
                ("panel (Tab)", MenuAction::SwitchPanel),
                ("end (Esc)", MenuAction::Back),
            ] {
                entry(row, 3.0, words, action);
            }
        });
    });
}

pub(in crate::hud) fn write_choice(choice: Res<Choice>, mut texts: Query<(&ChoiceText, &mut Text)>) {
    for (part, mut text) in &mut texts {
        set(&mut text, || {
            match part {
                ChoiceText::Difficulty => choice.difficulty.name(),
                ChoiceText::Players if choice.players == 1 => "one player",
                ChoiceText::Players => "two players",
                ChoiceText::Demo if choice.is_demo => "demo: on (D)",
                ChoiceText::Demo => "demo: off (D)",
            }
            .to_owned()
        });
    }
}
