//! Controls of the panel for toon surfaces.

use super::style_controls::{calm, slider, wide_slider};
use crate::materials::{ToonKey, ToonModel, ToonStyle};
use bevy::prelude::*;
use bevy_egui::egui;

pub(super) fn edit_toon(ui: &mut egui::Ui, toon: &mut ToonStyle) {
    edit_model(ui, &mut toon.model);
    edit_key(ui, &mut toon.key);
    ui.strong("steps");
    let bands = ToonStyle::MIN_BANDS..=ToonStyle::MAX_BANDS;
    ui.add(calm(egui::Slider::new(&mut toon.bands, bands)).text("bands"));
    slider(ui, "softness", &mut toon.softness, 1.0);
    ui.checkbox(&mut toon.highlight, "highlight");
    slider(ui, "rim light", &mut toon.rim, 1.0);
    ui.strong("outline");
    wide_slider(ui, "pixels", &mut toon.outline_width, ToonStyle::MAX_OUTLINE_WIDTH);
    wide_slider(ui, "meters", &mut toon.outline_meters, ToonStyle::MAX_OUTLINE_METERS);
    edit_color(ui, "color", &mut toon.outline_color);
}

fn edit_model(ui: &mut egui::Ui, model: &mut ToonModel) {
    ui.strong("colors");
    ui.horizontal(|ui| {
        let phong = if let ToonModel::Phong(phong) = *model { phong } else { default() };
        ui.selectable_value(model, ToonModel::RoomLight, "of the room's light");
        ui.selectable_value(model, ToonModel::Phong(phong), "Phong");
    });
    if let ToonModel::Phong(phong) = model {
        wide_slider(ui, "diffuse", &mut phong.diffuse, ToonStyle::MAX_COEFFICIENT);
        wide_slider(ui, "specular", &mut phong.specular, ToonStyle::MAX_COEFFICIENT);
        wide_slider(ui, "exponent", &mut phong.exponent, ToonStyle::MAX_EXPONENT);
    }
}

fn edit_key(ui: &mut egui::Ui, key: &mut ToonKey) {
    ui.strong("follow");
    ui.horizontal_wrapped(|ui| {
        let direction = if let ToonKey::Direction(direction) = *key { direction } else { Vec3::new(0.5, 1.0, -0.5) };
        ui.selectable_value(key, ToonKey::Prevailing, "prevailing light");
        ui.selectable_value(key, ToonKey::StrongestRealLight, "strongest light");
        ui.selectable_value(key, ToonKey::Direction(direction), "direction");
    });
    if let ToonKey::Direction(direction) = key {
        for (axis, value) in ["x", "y", "z"].into_iter().zip(direction.as_mut()) {
            ui.add(calm(egui::Slider::new(value, -1.0..=1.0)).max_decimals(3).text(axis));
        }
    }
}

fn edit_color(ui: &mut egui::Ui, label: &str, color: &mut Color) {
    ui.horizontal(|ui| {
        let mut rgb = color.to_linear().to_f32_array_no_alpha();
        if ui.color_edit_button_rgb(&mut rgb).changed() {
            *color = Color::linear_rgb(rgb[0], rgb[1], rgb[2]);
        }
        ui.label(label);
    });
}
