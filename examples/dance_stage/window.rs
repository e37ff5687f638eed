//! The stage in a window, with the measuring panel beside the camera image.

#[cfg(feature = "audio")]
use crate::game::MusicPlugin;
use crate::{
    Outcome, Show,
    dancer::Dance,
    game::{ControlsPlugin, MenuAction, Screen},
    options::Options,
    platform,
    remembered::{RememberPlugin, Remembered},
    stage,
    support::window_log,
    view::View,
};
use bevy::{
    camera::{CameraOutputMode, Viewport, visibility::RenderLayers},
    diagnostic::FrameTimeDiagnosticsPlugin,
    prelude::*,
    render::{diagnostic::RenderDiagnosticsPlugin, render_resource::BlendState},
    ui::IsDefaultUiCamera,
    window::{PrimaryWindow, WindowMode, WindowResolution},
};
use bevy_egui::{EguiGlobalSettings, PrimaryEguiContext};
use bevy_mirrorball::{
    debug::{MirrorballPanel, MirrorballPanelPlugin},
    prelude::*,
};
// Games have these with Bevy's default features, as `bevy::picking`.
use bevy_picking::{
    DefaultPickingPlugins,
    events::{Click, Pointer},
    mesh_picking::MeshPickingPlugin,
};
use std::num::NonZeroU32;

const TITLE: &str = "dance stage";

/// Runs the stage in a window, or on the page's canvas, with more in it.
pub(crate) fn run(options: &Options, add: impl FnOnce(&mut App)) -> Outcome<()> {
    let view = View::open(options, FeedPace::Live)?;
    let size = options.size.unwrap_or(view.size());
    // It is about cameras.
    let panel = MirrorballPanel { is_open: options.place.is_none() && cfg!(not(target_arch = "wasm32")), ..default() };
    let window = Window {
        title: TITLE.to_owned(),
        resolution: WindowResolution::new(size.x + if panel.is_open { panel.width as u32 } else { 0 }, size.y),
        // Lowest latency: no frames wait for the display.
        desired_maximum_frame_latency: NonZeroU32::new(1),
        // In a browser.
        canvas: Some("#stage".to_owned()),
        fit_canvas_to_parent: true,
        ..default()
    };
    let mut app = App::new();
    app.add_plugins((
        DefaultPlugins
            .set(platform::asset_plugin(options)?)
            .set(window_log())
            .set(WindowPlugin { primary_window: Some(window), ..default() }),
        FrameTimeDiagnosticsPlugin::default(),
        RenderDiagnosticsPlugin,
        MirrorballPlugins,
        MirrorballPanelPlugin,
        ControlsPlugin,
    ))
    .insert_resource(panel)
    .insert_resource(ClearColor(Color::srgb(0.11, 0.11, 0.12)))
    .add_plugins((DefaultPickingPlugins, MeshPickingPlugin))
    .add_observer(select)
    .add_systems(Startup, spawn_panel_camera)
    .add_systems(Update, (stage::switch_styles, hold_the_dance.run_if(not(in_state(Screen::Dance))), change_window))
    .add_systems(PreUpdate, leave_room_for_panel);
    #[cfg(feature = "audio")]
    app.add_plugins(MusicPlugin);
    add(&mut app);
    // Otherwise the panel would be drawn over the image of the first camera.
    app.world_mut().resource_mut::<EguiGlobalSettings>().auto_create_primary_context = false;
    // The game is shown over the camera's picture, beside the panel.
    view.spawn_camera(app.world_mut());
    app.add_plugins(RememberPlugin);
    let remembered = app.world().resource::<Remembered>().clone();
    app.insert_resource(remembered.latency());
    Show::open(options, options.choice(remembered.choice()))?.build(&mut app);
    if options.is_demo {
        app.world_mut().resource_mut::<NextState<Screen>>().set(Screen::Dance);
    }
    match app.run() {
        AppExit::Success => Ok(()),
        AppExit::Error(code) => Err(format!("ended with code {code}").into()),
    }
}

/// Lets what is switched fade over.
pub(crate) fn fade_styles(app: &mut App) {
    app.register_required_components_with::<SurfaceStyle, _>(|| StyleFade { seconds: 0.3 });
}

/// Spawns a camera for the panel that covers the whole window. The viewport of the AR camera is only a part of it.
fn spawn_panel_camera(mut commands: Commands) {
    let output_mode =
        CameraOutputMode::Write { blend_state: Some(BlendState::ALPHA_BLENDING), clear_color: ClearColorConfig::None };
    commands.spawn((
        PrimaryEguiContext,
        Camera2d,
        RenderLayers::none(),
        Camera { order: 1, output_mode, clear_color: ClearColorConfig::Custom(Color::NONE), ..default() },
    ));
}

/// Fits the viewport of the camera beside the panel.
fn leave_room_for_panel(
    panel: Res<MirrorballPanel>,
    windows: Query<&Window, With<PrimaryWindow>>,
    mut cameras: Query<&mut Camera, With<IsDefaultUiCamera>>,
) {
    let Ok(window) = windows.single() else {
        return;
    };
    let taken = if panel.is_open { panel.width * window.scale_factor() } else { 0.0 };
    let width = window.physical_width().saturating_sub(taken as u32);
    let physical_size = UVec2::new(width, window.physical_height());
    // A minimized window has no size, and a narrow one has no room beside the panel.
    let viewport = (physical_size.min_element() > 0).then(|| Viewport { physical_size, ..default() });
    for mut camera in &mut cameras {
        if camera.viewport.as_ref().map(|viewport| viewport.physical_size) != viewport.as_ref().map(|v| v.physical_size)
        {
            camera.viewport.clone_from(&viewport);
        }
    }
}

/// Shows the style of the thing under the pointer, unless an entry of a menu is before it. A click rises from the mesh
/// that it hits to its ancestors.
fn select(
    click: On<Pointer<Click>>,
    things: Query<(), With<SurfaceStyle>>,
    entries: Query<&Interaction>,
    mut panel: ResMut<MirrorballPanel>,
) {
    let is_on_menu = entries.iter().any(|interaction| *interaction != Interaction::None);
    if things.contains(click.entity) && !is_on_menu {
        *panel = MirrorballPanel { is_open: true, selected: Some(click.entity), ..*panel };
    }
}

fn change_window(
    mut actions: MessageReader<MenuAction>,
    mut panel: ResMut<MirrorballPanel>,
    mut windows: Query<&mut Window, With<PrimaryWindow>>,
) {
    for action in actions.read() {
        match action {
            MenuAction::SwitchPanel => panel.is_open = !panel.is_open,
            MenuAction::SwitchFullScreen => {
                for mut window in &mut windows {
                    window.mode = match window.mode {
                        WindowMode::Windowed => WindowMode::BorderlessFullscreen(MonitorSelection::Current),
                        _ => WindowMode::Windowed,
                    };
                }
            }
            _ => {}
        }
    }
}

fn hold_the_dance(keys: Res<ButtonInput<KeyCode>>, mut dance: ResMut<Dance>) {
    if keys.just_pressed(KeyCode::Space) {
        dance.is_held = !dance.is_held;
    }
}
