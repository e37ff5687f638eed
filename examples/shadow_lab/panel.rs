//! The panel with the method, the settings of the dome and the lamp.

use crate::{
    Lab,
    light::Lamp,
    method::{METHODS, Method},
    options::{COVERAGES, FILTERS, RESOLUTIONS, SAMPLES, SOFT_FILTER},
};
use bevy::{
    diagnostic::{DiagnosticsStore, FrameTimeDiagnosticsPlugin},
    prelude::*,
};
use bevy_egui::{EguiContexts, egui};
use bevy_mirrorball::shadows::{DomeState, PlanarShadow, PlanarShadowState, ShadowDomeLight, ShadowFilter};
use std::f32::consts::TAU;

pub(crate) fn draw_panel(
    mut contexts: EguiContexts,
    mut lab: ResMut<Lab>,
    domes: Query<&DomeState, With<ShadowDomeLight>>,
    planar: Query<&PlanarShadowState, With<PlanarShadow>>,
    diagnostics: Res<DiagnosticsStore>,
) {
    let Ok(ctx) = contexts.ctx_mut() else {
        return;
    };
    let mut wanted = lab.clone();
    egui::Window::new("shadows").default_width(280.0).show(ctx, |ui| {
        let Lab { lamp, method, dome, speed, .. } = &mut wanted;
        choose(ui, "method", &METHODS, method);
        if *method == Method::Dome {
            draw_dome(ui, dome);
        }
        ui.separator();
        ui.add(egui::Slider::new(&mut lamp.azimuth, 0.0..=TAU).text("lamp: azimuth"));
        ui.add(egui::Slider::new(&mut lamp.elevation, Lamp::ELEVATIONS).text("elevation"));
        ui.add(egui::Slider::new(&mut lamp.radius, 0.02..=0.6).text("angular radius"));
        ui.add(egui::Slider::new(&mut lamp.strength, 0.0..=6.0).text("strength"));
        ui.add(egui::Slider::new(speed, 0.0..=3.0).text("cars' speed"));
        ui.separator();
        for state in &domes {
            ui.label(format!(
                "{} casters · {} key lights · {} directions redrawn, {} outdated · the oldest of {} main ones is {} frames old",
                state.casters, state.key_lights, state.redrawn, state.outdated, state.main, state.oldest_main
            ));
        }
        for state in &planar {
            ui.label(format!("{} casters · {} lights · drawn {} times", state.casters, state.lights, state.drawings));
        }
        let frame = diagnostics.get(&FrameTimeDiagnosticsPlugin::FRAME_TIME).and_then(|time| time.smoothed());
        ui.label(format!("{:.1} ms a frame", frame.unwrap_or(0.0)));
    });
    lab.set_if_neq(wanted);
}

/// Draws one line per field of the dome.
fn draw_dome(ui: &mut egui::Ui, dome: &mut ShadowDomeLight) {
    let most = ShadowDomeLight::MAX_DIRECTIONS;
    ui.add(egui::Slider::new(&mut dome.directions, 1..=most).logarithmic(true).text("directions"));
    ui.add(egui::Slider::new(&mut dome.key_lights, 0..=ShadowDomeLight::MAX_KEY_LIGHTS).text("key lights"));
    choose(ui, "coverage", &COVERAGES, &mut dome.coverage);
    choose(ui, "resolution", &RESOLUTIONS, &mut dome.resolution);
    // The radius of the soft filter has a slider of its own.
    let mut filter = if let ShadowFilter::Pcss { .. } = dome.filter { SOFT_FILTER } else { dome.filter };
    choose(ui, "filter", &FILTERS, &mut filter);
    if std::mem::discriminant(&filter) != std::mem::discriminant(&dome.filter) {
        dome.filter = filter;
    }
    if let ShadowFilter::Pcss { angular_radius } = &mut dome.filter {
        ui.add(egui::Slider::new(angular_radius, 0.0..=0.5).text("light's angular radius"));
    }
    choose(ui, "samples", &SAMPLES, &mut dome.samples);
    ui.add(egui::Slider::new(&mut dome.refreshed_per_frame, 1..=most).logarithmic(true).text("refreshed per frame"));
    ui.add(egui::Slider::new(&mut dome.dim_share, 0.0..=0.2).text("share of dim directions"));
    ui.add(egui::Slider::new(&mut dome.surfels, 0..=ShadowDomeLight::MAX_SURFELS).text("surfels for bounced light"));
}

/// Draws a combo box of named values.
fn choose<T: Copy + PartialEq>(ui: &mut egui::Ui, label: &str, values: &[(&str, T)], chosen: &mut T) {
    let current = values.iter().find(|(_, value)| value == chosen);
    egui::ComboBox::from_label(label).selected_text(current.map_or("other", |(name, _)| *name)).show_ui(ui, |ui| {
        for (name, value) in values {
            ui.selectable_value(chosen, *value, *name);
        }
    });
}
