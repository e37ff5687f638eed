//! What players see over the picture: their arrows, life, score and verdicts, and the screens before and after.
//!
//! Sizes are in hundredths of the shorter side of the picture, so that everything can be read at 640 × 480 and at 4K.

mod arrow_images;
mod highway;
mod menus;
mod status;

use crate::game::{GameSystems, MenuAction, Player, Screen};
use arrow_images::ArrowImages;
use bevy::{prelude::*, text::RemSize, ui::IsDefaultUiCamera};

/// Shows the game over the camera with [`IsDefaultUiCamera`](bevy::ui::IsDefaultUiCamera).
pub(crate) struct HudPlugin;

impl Plugin for HudPlugin {
    fn build(&self, app: &mut App) {
        let dances = in_state(Screen::Dance);
        app.init_resource::<ArrowImages>()
            .add_systems(OnEnter(Screen::Title), menus::title::show_title)
            .add_systems(OnEnter(Screen::Results), menus::results::show_results)
            .add_systems(OnEnter(Screen::Calibration), menus::calibration::show_calibration)
            .add_systems(OnEnter(Screen::Help), menus::help::show_help)
            .add_systems(
                Update,
                (
                    build,
                    (
                        highway::move_arrows,
                        highway::light_targets,
                        status::fill_life,
                        status::write_score,
                        status::write_verdict,
                        status::write_combo,
                        status::write_pause,
                    ),
                )
                    .chain()
                    .after(GameSystems::Judge)
                    .run_if(dances),
            )
            .add_message::<MenuAction>()
            .add_systems(Update, (fit_text, menus::press_entries))
            .add_systems(Update, menus::title::write_choice.run_if(in_state(Screen::Title)))
            .add_systems(Update, menus::calibration::write_calibration.run_if(in_state(Screen::Calibration)));
    }
}

/// Player whose state a node shows.
#[derive(Component)]
struct Shows(Entity);

/// Builds the view of each new player.
fn build(mut commands: Commands, images: Res<ArrowImages>, new: Query<(Entity, &Player), Added<Player>>) {
    for (entity, player) in &new {
        let mut side = commands.spawn((highway::side(player.number), DespawnOnExit(Screen::Dance)));
        highway::spawn_lanes(&mut side, entity, &images);
        status::spawn(&mut side, entity);
    }
}

/// Lets one rem of text be a hundredth of the picture's shorter side. Fonts may have such sizes themselves, but are of
/// no size, with a warning, before the camera's picture has one.
fn fit_text(cameras: Query<&Camera, With<IsDefaultUiCamera>>, mut rem: ResMut<RemSize>) {
    if let Some(size) = cameras.iter().find_map(Camera::logical_viewport_size) {
        rem.set_if_neq(RemSize(size.min_element() / 100.0));
    }
}

/// Text of a size in hundredths of the picture's shorter side, with a dark shadow, so that it can be read before
/// everything.
fn text(size: f32, color: Color, words: impl Into<String>) -> impl Bundle {
    let shadow = TextShadow { offset: Vec2::splat(2.0), color: Color::srgba(0.0, 0.0, 0.0, 0.8) };
    (Text(words.into()), TextFont { font_size: FontSize::Rem(size), ..default() }, TextColor(color), shadow)
}
