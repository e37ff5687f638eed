//! Reports of the panel: checks, timings and memory.

use crate::debug::{
    BALL_ERROR, CheckLevel, Checklist, DECODE, DETECT, KEY_LIGHT_ANGLE, LIGHTING_AGE, MAIN_THREAD, MEASURE, RECOVER,
    device_memory,
};
use bevy::{
    diagnostic::{Diagnostic, DiagnosticPath, DiagnosticsStore, FrameTimeDiagnosticsPlugin},
    prelude::*,
    render::renderer::RenderDevice,
};
use bevy_egui::egui;

pub(super) fn draw_checks(ui: &mut egui::Ui, checklist: &Checklist) {
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

/// Diagnostics of the stages, and their labels in the panel.
const STAGES: [(&DiagnosticPath, &str); 8] = [
    (&DECODE, "decode"),
    (&DETECT, "detect markers"),
    (&MEASURE, "measure ball, paper"),
    (&RECOVER, "recover clipped light"),
    (&LIGHTING_AGE, "lighting age"),
    (&MAIN_THREAD, "on the main thread"),
    (&BALL_ERROR, "virtual ball's error"),
    (&KEY_LIGHT_ANGLE, "key light's error"),
];

/// Passes on the GPU, by the part after `render/mirrorball_` of their diagnostic paths, and their labels.
const PASSES: [(&str, &str); 6] = [
    ("probe_unwrap", "unwrap ball"),
    ("environment_filter", "filter"),
    ("shadows_depth", "shadow maps"),
    ("shadows_weights", "shadow weights"),
    ("shadows_visibility", "visibility"),
    ("camera_background", "background"),
];

pub(super) fn draw_timings(ui: &mut egui::Ui, diagnostics: &DiagnosticsStore) {
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

/// Draws the table of GPU memory. Called only while the section is open, because it visits every allocation.
pub(super) fn draw_memory(ui: &mut egui::Ui, device: Option<&RenderDevice>) {
    let Some(parts) = device.and_then(device_memory) else {
        ui.label("this backend does not report it");
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
