//! Controls of the panel for classic surfaces.

use super::style_controls::{slider, wide_slider};
use crate::materials::{ClassicModel, ClassicStyle};
use bevy::prelude::*;
use bevy_egui::egui;

const MAX: f32 = ClassicStyle::MAX_COEFFICIENT;

pub(super) fn edit_classic(ui: &mut egui::Ui, classic: &mut ClassicStyle) {
    edit_model(ui, &mut classic.model);
    ui.strong("reflection");
    optional(ui, "roughness of its own", &mut classic.roughness, 0.0, 1.0);
    optional(ui, "refraction", &mut classic.refraction, 0.67, ClassicStyle::MAX_REFRACTION);
    optional(ui, "Fresnel", &mut classic.fresnel, 0.04, 1.0);
    wide_slider(ui, "threshold", &mut classic.reflection_threshold, ClassicStyle::MAX_REFLECTION_THRESHOLD);
}

fn edit_model(ui: &mut egui::Ui, model: &mut ClassicModel) {
    ui.horizontal(|ui| {
        let combined = if let ClassicModel::Combined(combined) = *model { combined } else { default() };
        let sphere_map = if let ClassicModel::SphereMap(model) = *model { model } else { default() };
        let mixed = if let ClassicModel::Mixed(mixed) = *model { mixed } else { default() };
        ui.selectable_value(model, ClassicModel::GlossMap, "gloss map");
        ui.selectable_value(model, ClassicModel::Combined(combined), "combined");
        ui.selectable_value(model, ClassicModel::Mixed(mixed), "mixed");
        ui.selectable_value(model, ClassicModel::SphereMap(sphere_map), "sphere map");
    });
    match model {
        ClassicModel::Combined(combined) => {
            wide_slider(ui, "ambient", &mut combined.ambient, MAX);
            wide_slider(ui, "diffuse", &mut combined.diffuse, MAX);
            wide_slider(ui, "specular", &mut combined.specular, MAX);
            wide_slider(ui, "reflection", &mut combined.reflection, MAX);
            wide_slider(ui, "exponent", &mut combined.exponent, ClassicStyle::MAX_EXPONENT);
        }
        ClassicModel::Mixed(mixed) => {
            wide_slider(ui, "base", &mut mixed.base, MAX);
            slider(ui, "diffuse", &mut mixed.diffuse, 1.0);
            slider(ui, "mirror", &mut mixed.mirror, 1.0);
        }
        ClassicModel::SphereMap(sphere_map) => {
            wide_slider(ui, "diffuse", &mut sphere_map.diffuse, MAX);
            wide_slider(ui, "mirror", &mut sphere_map.mirror, MAX);
        }
        // The alpha of the base color says where the surface mirrors.
        ClassicModel::GlossMap => {}
    }
}

/// Draws a check box, and a slider while it is on.
fn optional(ui: &mut egui::Ui, name: &str, value: &mut Option<f32>, start: f32, largest: f32) {
    ui.horizontal(|ui| {
        let mut is_on = value.is_some();
        ui.checkbox(&mut is_on, name);
        if is_on != value.is_some() {
            *value = is_on.then_some(start);
        }
        if let Some(value) = value {
            slider(ui, "", value, largest);
        }
    });
}
