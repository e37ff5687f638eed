//! The screens before and after a dance. What can be chosen can be clicked, too.

pub(super) mod calibration;
pub(super) mod help;
pub(super) mod results;
pub(super) mod title;

use super::text;
use crate::game::MenuAction;
use bevy::prelude::*;

const PALE: Color = Color::srgb(0.8, 0.85, 0.9);
const GOLD: Color = Color::srgb(1.0, 0.85, 0.4);
/// Behind an entry of a menu, and behind the one under the pointer.
const ENTRY: Color = Color::srgba(1.0, 1.0, 1.0, 0.10);
const HOVERED: Color = Color::srgba(1.0, 0.85, 0.4, 0.35);

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
        row_gap: vmin(0.8),
        ..default()
    };
    (node, BackgroundColor(Color::srgba(0.02, 0.02, 0.05, 0.6)))
}

/// Entries of a menu side by side, in several rows where there is no room for one.
fn row(panel: &mut ChildSpawnerCommands, entries: impl FnOnce(&mut ChildSpawnerCommands)) {
    let node = Node {
        flex_wrap: FlexWrap::Wrap,
        align_items: AlignItems::Center,
        justify_content: JustifyContent::Center,
        column_gap: vmin(1.5),
        row_gap: vmin(0.8),
        ..default()
    };
    panel.spawn(node).with_children(entries);
}

/// What happens when an entry of a menu is clicked.
#[derive(Component)]
pub(super) struct Entry(MenuAction);

/// An entry of a menu. The words are on a child, which the returned commands are for.
fn entry<'a>(
    menu: &'a mut ChildSpawnerCommands,
    size: f32,
    words: impl Into<String>,
    action: MenuAction,
) -> EntityCommands<'a> {
    let node =
        Node { padding: UiRect::axes(vmin(1.2), vmin(0.4)), border_radius: BorderRadius::all(vmin(0.8)), ..default() };
    let button = menu.spawn((node, Button, BackgroundColor(ENTRY), Entry(action))).id();
    let mut words = menu.commands_mut().spawn(text(size, Color::WHITE, words));
    words.insert(ChildOf(button));
    words
}

/// Lights the entry under the pointer, and acts on clicks.
pub(super) fn press_entries(
    mut entries: Query<(&Interaction, &Entry, &mut BackgroundColor), Changed<Interaction>>,
    mut actions: MessageWriter<MenuAction>,
) {
    for (interaction, entry, mut background) in &mut entries {
        background.0 = if *interaction == Interaction::None { ENTRY } else { HOVERED };
        if *interaction == Interaction::Pressed {
            actions.write(entry.0);
        }
    }
}
