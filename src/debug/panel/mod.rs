//! Mirrorball panel: camera frame, measured maps, checks, timings, memory, effects, and the style of each entity.

mod classic_controls;
mod effects;
mod figures;
mod style_controls;
mod switches;
mod toon_controls;

pub use style_controls::edit_surface_style;

use super::{Checklist, MapView, MapViewPlugin, ShownMap};
use crate::{
    camera::{ArCamera, FrameTexture, camera_rank},
    prefilter::FilteredEnvironment,
};
use bevy::{diagnostic::DiagnosticsStore, ecs::entity_disabling::Disabled, prelude::*, render::renderer::RenderDevice};
use bevy_egui::{EguiContexts, EguiPlugin, EguiPrimaryContextPass, EguiTextureHandle, egui};
use effects::{Effects, draw_effects};
use figures::{draw_checks, draw_memory, draw_timings};
use switches::{StyledEntity, choose_map, draw_styles};

/// Draws the Mirrorball panel, a window in the primary egui context. [`MirrorballPanel`] opens and closes it.
///
/// Adds [`EguiPlugin`] and [`MapViewPlugin`] if they are missing.
///
/// ```no_run
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// use bevy_mirrorball::debug::MirrorballPanelPlugin;
///
/// App::new().add_plugins((DefaultPlugins, MirrorballPlugins, MirrorballPanelPlugin)).run();
/// ```
pub struct MirrorballPanelPlugin;

impl Plugin for MirrorballPanelPlugin {
    fn build(&self, app: &mut App) {
        if !app.is_plugin_added::<EguiPlugin>() {
            app.add_plugins(EguiPlugin::default());
        }
        if !app.is_plugin_added::<MapViewPlugin>() {
            app.add_plugins(MapViewPlugin);
        }
        app.init_resource::<MirrorballPanel>()
            .add_systems(Startup, |mut commands: Commands, mut images: ResMut<Assets<Image>>| {
                commands.spawn((PanelMap, MapView::new(ShownMap::Measured, &mut images)));
            })
            .add_systems(PreUpdate, disable_closed_map.run_if(resource_changed::<MirrorballPanel>))
            .add_systems(EguiPrimaryContextPass, draw_panel.run_if(|panel: Res<MirrorballPanel>| panel.is_open));
    }
}

/// State of the Mirrorball panel.
#[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Resource, Debug, Clone, PartialEq)]
pub struct MirrorballPanel {
    /// Whether the panel is shown. Defaults to `true`.
    pub is_open: bool,
    /// Width in logical pixels. Defaults to 370.
    pub width: f32,
    /// Entity with a [`SurfaceStyle`](crate::materials::SurfaceStyle) whose settings are shown. Games may set it, for
    /// example when a player clicks a thing. Defaults to `None`.
    pub selected: Option<Entity>,
}

impl Default for MirrorballPanel {
    fn default() -> Self {
        Self { is_open: true, width: 370.0, selected: None }
    }
}

/// Marker of the panel's own map view.
#[derive(Component)]
struct PanelMap;

type EvenDisabled = (With<PanelMap>, Or<(With<Disabled>, Without<Disabled>)>);

/// Disables the map view while the panel is closed, so that it is not drawn.
fn disable_closed_map(mut commands: Commands, panel: Res<MirrorballPanel>, maps: Query<Entity, EvenDisabled>) {
    for map in &maps {
        if panel.is_open {
            commands.entity(map).remove::<Disabled>();
        } else {
            commands.entity(map).insert(Disabled);
        }
    }
}

fn draw_panel(
    mut commands: Commands,
    mut contexts: EguiContexts,
    mut panel: ResMut<MirrorballPanel>,
    checklist: Checklist,
    diagnostics: Res<DiagnosticsStore>,
    mut map: Single<&mut MapView, With<PanelMap>>,
    filtered: Query<&FilteredEnvironment>,
    cameras: Query<(Entity, &Camera, &FrameTexture), With<ArCamera>>,
    mut styles: Query<StyledEntity>,
    mut effects: Effects,
    device: Option<Res<RenderDevice>>,
) {
    let map_image = contexts.add_image(EguiTextureHandle::Weak(map.image.id()));
    let roughest = filtered.iter().map(|maps| maps.roughest_level()).max().unwrap_or(0);
    let first = cameras.iter().min_by_key(|(entity, camera, _)| camera_rank(*entity, camera));
    let camera_frame = first.map(|(.., frame)| (frame.size(), frame.image.id()));
    let camera_frame = camera_frame.map(|(size, id)| (size, contexts.add_image(EguiTextureHandle::Weak(id))));
    let ctx = match contexts.ctx_mut() {
        Ok(ctx) => ctx,
        Err(error) => {
            warn_once!("the measuring panel needs exactly one primary egui context: {error}");
            return;
        }
    };
    let mut after = *panel;
    egui::Window::new("measured light")
        .open(&mut after.is_open)
        .anchor(egui::Align2::RIGHT_TOP, egui::Vec2::ZERO)
        .resizable(false)
        .vscroll(true)
        .fixed_size([panel.width, ctx.viewport_rect().height()])
        .show(ctx, |ui| {
            draw_checks(ui, &checklist);
            ui.separator();
            draw_styles(ui, &mut styles, &mut after.selected, &mut commands);
            ui.separator();
            egui::CollapsingHeader::new("effects").show(ui, |ui| draw_effects(ui, &mut effects));
            egui::CollapsingHeader::new("environment").default_open(true).show(ui, |ui| {
                choose_map(ui, &mut map, roughest);
                show_image(ui, map_image, MapView::SIZE);
            });
            egui::CollapsingHeader::new("timings").default_open(true).show(ui, |ui| draw_timings(ui, &diagnostics));
            egui::CollapsingHeader::new("memory of the graphics device")
                .show(ui, |ui| draw_memory(ui, device.as_deref()));
            egui::CollapsingHeader::new("camera frame").default_open(false).show(ui, |ui| match camera_frame {
                Some((size, texture)) => show_image(ui, texture, size),
                None => {
                    ui.label("none yet");
                }
            });
        });
    panel.set_if_neq(after);
}

/// Draws an image over the whole width, at its aspect ratio.
fn show_image(ui: &mut egui::Ui, texture: egui::TextureId, size: UVec2) {
    let width = ui.available_width();
    let height = width * size.y as f32 / size.x.max(1) as f32;
    ui.image(egui::load::SizedTexture::new(texture, egui::vec2(width, height)));
}
