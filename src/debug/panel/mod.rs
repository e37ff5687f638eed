//! The measuring panel: what the camera sees, what was measured in it, what it cost, and how each entity looks.

use super::{
    BALL_ERROR, CheckLevel, Checklist, DECODE, DETECT, KEY_LIGHT_ANGLE, LIGHTING_AGE, MEASURE, MapView, MapViewPlugin,
    RECOVER, ShownMap, device_memory,
};
use crate::{
    camera::{ArCamera, FrameTexture},
    materials::{SurfaceStyle, ToonStyle},
    prefilter::FilteredEnvironment,
};
use bevy::{
    diagnostic::{Diagnostic, DiagnosticPath, DiagnosticsStore, FrameTimeDiagnosticsPlugin},
    ecs::entity_disabling::Disabled,
    prelude::*,
    render::renderer::RenderDevice,
};
use bevy_egui::{EguiContexts, EguiPlugin, EguiPrimaryContextPass, EguiTextureHandle, egui};

/// Draws the measuring panel, a window of the primary egui context; [`MeasuringPanel`] opens and closes it.
///
/// Adds [`EguiPlugin`] if the game has not.
///
/// ```no_run
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// use bevy_mirrorball::debug::MeasuringPanelPlugin;
///
/// App::new().add_plugins((DefaultPlugins, MirrorballPlugins, MeasuringPanelPlugin)).run();
/// ```
pub struct MeasuringPanelPlugin;

impl Plugin for MeasuringPanelPlugin {
    fn build(&self, app: &mut App) {
        if !app.is_plugin_added::<EguiPlugin>() {
            app.add_plugins(EguiPlugin::default());
        }
        if !app.is_plugin_added::<MapViewPlugin>() {
            app.add_plugins(MapViewPlugin);
        }
        app.init_resource::<MeasuringPanel>()
            .add_systems(Startup, |mut commands: Commands, mut images: ResMut<Assets<Image>>| {
                commands.spawn((PanelMap, MapView::new(ShownMap::Measured, &mut images)));
            })
            .add_systems(PreUpdate, rest_map.run_if(resource_changed::<MeasuringPanel>))
            .add_systems(EguiPrimaryContextPass, draw_panel.run_if(|panel: Res<MeasuringPanel>| panel.is_open));
    }
}

/// Whether the panel is shown.
#[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Resource, Debug, Clone, PartialEq)]
pub struct MeasuringPanel {
    /// Defaults to `true`.
    pub is_open: bool,
    /// Width in logical pixels. Defaults to 340.
    pub width: f32,
}

impl Default for MeasuringPanel {
    fn default() -> Self {
        Self { is_open: true, width: 340.0 }
    }
}

/// On the panel's view of a map.
#[derive(Component)]
struct PanelMap;

type RestingOrNot = (With<PanelMap>, Or<(With<Disabled>, Without<Disabled>)>);

/// While the panel is closed nobody looks at its map.
fn rest_map(mut commands: Commands, panel: Res<MeasuringPanel>, maps: Query<Entity, RestingOrNot>) {
    for map in &maps {
        if panel.is_open {
            commands.entity(map).remove::<Disabled>();
        } else {
            commands.entity(map).insert(Disabled);
        }
    }
}

/// The diagnostics of the stages and how the panel calls them.
const STAGES: [(&DiagnosticPath, &str); 7] = [
    (&DECODE, "decode"),
    (&DETECT, "find markers"),
    (&MEASURE, "measure ball, paper"),
    (&RECOVER, "recover clipped light"),
    (&LIGHTING_AGE, "lighting age"),
    (&BALL_ERROR, "virtual ball's error"),
    (&KEY_LIGHT_ANGLE, "key light's error"),
];

/// The passes on the GPU, by what follows `render/mirrorball_` in their diagnostics.
const PASSES: [(&str, &str); 6] = [
    ("probe_unwrap", "unwrap ball"),
    ("environment_filter", "filter"),
    ("shadows_depth", "shadow maps"),
    ("shadows_weights", "shadow weights"),
    ("shadows_visibility", "visibility"),
    ("camera_background", "background"),
];

type StyledEntity = (Entity, Option<&'static Name>, &'static mut SurfaceStyle);

fn draw_panel(
    mut contexts: EguiContexts,
    mut panel: ResMut<MeasuringPanel>,
    checklist: Checklist,
    diagnostics: Res<DiagnosticsStore>,
    mut map: Single<&mut MapView, With<PanelMap>>,
    filtered: Query<&FilteredEnvironment>,
    cameras: Query<&FrameTexture, With<ArCamera>>,
    mut styles: Query<StyledEntity>,
    device: Option<Res<RenderDevice>>,
) {
    let map_picture = contexts.add_image(EguiTextureHandle::Weak(map.image.id()));
    let roughest = filtered.iter().map(|maps| maps.roughest_level()).max().unwrap_or(0);
    let picture = cameras.iter().next().map(|frame| (frame.size(), frame.image.id()));
    let picture = picture.map(|(size, id)| (size, contexts.add_image(EguiTextureHandle::Weak(id))));
    let ctx = match contexts.ctx_mut() {
        Ok(ctx) => ctx,
        Err(error) => {
            warn_once!("the measuring panel needs exactly one primary egui context: {error}");
            return;
        }
    };
    let mut is_open = panel.is_open;
    let width = panel.width;
    egui::Window::new("measured light")
        .open(&mut is_open)
        .anchor(egui::Align2::RIGHT_TOP, egui::Vec2::ZERO)
        .resizable(false)
        .vscroll(true)
        .fixed_size([width, ctx.viewport_rect().height()])
        .show(ctx, |ui| {
            draw_checks(ui, &checklist);
            ui.separator();
            draw_styles(ui, &mut styles);
            ui.separator();
            egui::CollapsingHeader::new("environment").default_open(true).show(ui, |ui| {
                choose_map(ui, &mut map, roughest);
                show_image(ui, map_picture, MapView::SIZE);
            });
            egui::CollapsingHeader::new("timings").default_open(true).show(ui, |ui| draw_timings(ui, &diagnostics));
            egui::CollapsingHeader::new("memory of the graphics device")
                .show(ui, |ui| draw_memory(ui, device.as_deref()));
            egui::CollapsingHeader::new("camera picture").default_open(false).show(ui, |ui| match picture {
                Some((size, picture)) => show_image(ui, picture, size),
                None => {
                    ui.label("none yet");
                }
            });
        });
    panel.set_if_neq(MeasuringPanel { is_open, width });
}

fn choose_map(ui: &mut egui::Ui, map: &mut MapView, roughest: u32) {
    let mut chosen = map.map;
    ui.horizontal(|ui| {
        let level = if let ShownMap::Glossy(level) = chosen { level } else { 0 };
        for (choice, name) in [
            (ShownMap::Measured, "measured"),
            (ShownMap::Confidence, "confidence"),
            (ShownMap::Diffuse, "diffuse"),
            (ShownMap::Glossy(level), "glossy"),
        ] {
            ui.radio_value(&mut chosen, choice, name);
        }
    });
    if let ShownMap::Glossy(level) = &mut chosen {
        ui.add(egui::Slider::new(level, 0..=roughest).text("level"));
    }
    if chosen != map.map {
        map.map = chosen;
    }
}

fn draw_checks(ui: &mut egui::Ui, checklist: &Checklist) {
    for check in checklist.checks() {
        let (sign, color) = match check.level {
            CheckLevel::Good => ("✔", egui::Color32::from_rgb(90, 200, 90)),
            CheckLevel::Warning => ("⚠", egui::Color32::from_rgb(240, 190, 60)),
            CheckLevel::Missing => ("✖", egui::Color32::from_rgb(240, 90, 80)),
        };
        ui.horizontal_wrapped(|ui| {
            ui.colored_label(color, sign);
            ui.strong(check.topic);
            ui.label(check.text);
        });
    }
}

/// Fills the width and keeps the shape.
fn show_image(ui: &mut egui::Ui, texture: egui::TextureId, size: UVec2) {
    let width = ui.available_width();
    let height = width * size.y as f32 / size.x.max(1) as f32;
    ui.image(egui::load::SizedTexture::new(texture, egui::vec2(width, height)));
}

fn draw_styles(ui: &mut egui::Ui, styles: &mut Query<StyledEntity>) {
    let mut entities: Vec<_> = styles.iter_mut().collect();
    entities.sort_by(|(a, a_name, _), (b, b_name, _)| (a_name, a).cmp(&(b_name, b)));
    egui::Grid::new("styles").num_columns(4).show(ui, |ui| {
        for (number, (entity, name, style)) in (1..).zip(&mut entities) {
            let name = name.map_or_else(|| entity.to_string(), ToString::to_string);
            ui.label(format!("{number} {name}"));
            let is_toon = matches!(**style, SurfaceStyle::Toon(_));
            if ui.selectable_label(is_toon, "toon").clicked() && !is_toon {
                **style = SurfaceStyle::Toon(ToonStyle::default());
            }
            for (label, choice) in [("image-based", SurfaceStyle::ImageBased), ("Bevy", SurfaceStyle::Engine)] {
                if ui.selectable_label(**style == choice, label).clicked() {
                    style.set_if_neq(choice);
                }
            }
            ui.end_row();
        }
    });
}

/// Only while it is open: it looks at every allocation.
fn draw_memory(ui: &mut egui::Ui, device: Option<&RenderDevice>) {
    let Some(parts) = device.and_then(device_memory) else {
        ui.label("this backend does not tell");
        return;
    };
    egui::Grid::new("memory").num_columns(2).striped(true).show(ui, |ui| {
        let mut row = |label: &str, bytes: u64| {
            ui.label(label);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.monospace(format!("{:.2} MiB", bytes as f64 / f64::from(1 << 20)));
            });
            ui.end_row();
        };
        row("all", parts.iter().map(|part| part.bytes).sum());
        for part in &parts {
            row(part.label.trim_start_matches("mirrorball_"), part.bytes);
        }
    });
}

fn draw_timings(ui: &mut egui::Ui, diagnostics: &DiagnosticsStore) {
    egui::Grid::new("timings").num_columns(2).striped(true).show(ui, |ui| {
        let mut row = |label: &str, diagnostic: Option<&Diagnostic>| {
            let Some((diagnostic, value)) = diagnostic.and_then(|found| Some((found, found.smoothed()?))) else {
                return;
            };
            let unit = match diagnostic.suffix.trim() {
                "" => "ms",
                unit => unit,
            };
            ui.label(label);
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                ui.monospace(format!("{value:.1} {unit}"));
            });
            ui.end_row();
        };
        row("frame", diagnostics.get(&FrameTimeDiagnosticsPlugin::FRAME_TIME));
        for (path, label) in STAGES {
            row(label, diagnostics.get(path));
        }
        for (pass, label) in PASSES {
            let named = |clock: &str| {
                let path = format!("render/mirrorball_{pass}/elapsed_{clock}");
                diagnostics.iter().find(|diagnostic| diagnostic.path().as_str() == path)
            };
            row(label, named("gpu"));
        }
    });
}
