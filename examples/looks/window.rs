//! The recorded desk in a window, where clicks select things.

use crate::{
    desk::{self, CLIP, STILL},
    look::Thing,
    options::Options,
    panel::{StylesFile, draw_panel},
    support::{Outcome, asset_path, window_log},
};
use bevy::{prelude::*, window::WindowResolution};
use bevy_egui::{EguiPlugin, EguiPrimaryContextPass, input::EguiWantsInput};
use bevy_mirrorball::{camera::Clip, prelude::*};
// Games have these with Bevy's default features, as `bevy::picking`.
use bevy_picking::{
    DefaultPickingPlugins,
    events::{Click, Pointer},
    mesh_picking::MeshPickingPlugin,
};

/// The thing whose look the panel edits.
#[derive(Resource, Default)]
pub(crate) struct Selected(pub Option<Entity>);

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let looks = options.looks()?;
    let window = Window {
        title: "looks · click a thing to edit its look · Space: hold the camera · Esc: end".to_owned(),
        // Twice the size of the recorded frames.
        resolution: WindowResolution::new(1280, 960),
        ..default()
    };
    let window = WindowPlugin { primary_window: Some(window), ..default() };
    let mut app = App::new();
    app.add_plugins((DefaultPlugins.set(window_log()).set(window), EguiPlugin::default()))
        .add_plugins((DefaultPickingPlugins, MeshPickingPlugin))
        .init_resource::<Selected>()
        .insert_resource(StylesFile::new(options.styles.as_deref()))
        .add_observer(select)
        .add_systems(Startup, film)
        .add_systems(Update, (hold, end))
        .add_systems(EguiPrimaryContextPass, draw_panel);
    // What is chosen in the panel fades in.
    app.register_required_components_with::<Thing, _>(|| StyleFade { seconds: 0.3 });
    desk::build(&mut app, looks);
    match app.run() {
        AppExit::Success => Ok(()),
        AppExit::Error(code) => Err(format!("ended with code {code}").into()),
    }
}

/// Spawns the camera with the intrinsics of the recording, which single frames of it do not have.
fn film(mut commands: Commands) -> Result {
    let intrinsics = Clip::open(asset_path(CLIP))?.intrinsics;
    commands.spawn((ArCamera { intrinsics, ..default() }, CameraFeed::clip(asset_path(CLIP))));
    Ok(())
}

/// Holds the camera where it sees the things best, or lets it move again.
fn hold(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    camera: Single<Entity, With<ArCamera>>,
    mut is_held: Local<bool>,
) {
    if keys.just_pressed(KeyCode::Space) {
        *is_held = !*is_held;
        let feed = if *is_held { CameraFeed::file(asset_path(STILL)) } else { CameraFeed::clip(asset_path(CLIP)) };
        commands.entity(*camera).insert(feed);
    }
}

/// Selects the thing under the pointer. A click rises from the mesh that it hits to the thing whose part that is.
fn select(
    click: On<Pointer<Click>>,
    panel: Res<EguiWantsInput>,
    things: Query<(), With<Thing>>,
    mut selected: ResMut<Selected>,
) {
    if things.contains(click.entity) && !panel.wants_any_pointer_input() {
        selected.0 = Some(click.entity);
    }
}

fn end(keys: Res<ButtonInput<KeyCode>>, panel: Res<EguiWantsInput>, mut exit: MessageWriter<AppExit>) {
    if keys.just_pressed(KeyCode::Escape) && !panel.wants_any_keyboard_input() {
        exit.write(AppExit::Success);
    }
}
