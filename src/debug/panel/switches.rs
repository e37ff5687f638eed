//! Controls of the panel: the map to show, and the style of each entity.

use super::style_controls::{choose_kind, edit_settings, slider};
use crate::{
    debug::{MapView, ShownMap},
    materials::{MeasuredLightWeight, SurfaceStyle},
};
use bevy::prelude::*;
use bevy_egui::egui;

pub(super) fn choose_map(ui: &mut egui::Ui, map: &mut MapView, roughest: u32) {
    let mut chosen = map.map;
    ui.horizontal(|ui| {
        let level = if let ShownMap::Specular(level) = chosen { level } else { 0 };
        for (choice, name) in [
            (ShownMap::Measured, "measured"),
            (ShownMap::Confidence, "confidence"),
            (ShownMap::Diffuse, "diffuse"),
            (ShownMap::Specular(level), "specular"),
        ] {
            ui.radio_value(&mut chosen, choice, name);
        }
    });
    if let ShownMap::Specular(level) = &mut chosen {
        ui.add(egui::Slider::new(level, 0..=roughest).text("level"));
    }
    if chosen != map.map {
        map.map = chosen;
    }
}

pub(super) type StyledEntity =
    (Entity, Option<&'static Name>, &'static mut SurfaceStyle, Option<&'static MeasuredLightWeight>);

/// Draws a row for each style, and all settings of the one that is selected by its name.
pub(super) fn draw_styles(
    ui: &mut egui::Ui,
    styles: &mut Query<StyledEntity>,
    selected: &mut Option<Entity>,
    commands: &mut Commands,
) {
    let mut entities: Vec<_> = styles.iter_mut().collect();
    entities.sort_by(|(a, a_name, ..), (b, b_name, ..)| (a_name, a).cmp(&(b_name, b)));
    // As much as fits the width of the panel.
    egui::Grid::new("styles").num_columns(5).spacing([4.0, 4.0]).show(ui, |ui| {
        for (number, (entity, name, style, _)) in (1..).zip(&mut entities) {
            let is_selected = *selected == Some(*entity);
            if ui.selectable_label(is_selected, format!("{number} {}", name_of(*entity, *name))).clicked() {
                *selected = (!is_selected).then_some(*entity);
            }
            let mut edited = **style;
            choose_kind(ui, &mut edited);
            style.set_if_neq(edited);
            ui.end_row();
        }
    });
    let edited = entities.into_iter().find(|(entity, ..)| *selected == Some(*entity));
    let Some((entity, name, mut style, weight)) = edited else {
        return;
    };
    ui.separator();
    ui.heading(name_of(entity, name));
    let mut edited = *style;
    edit_settings(ui, &mut edited);
    style.set_if_neq(edited);
    let before = weight.copied().unwrap_or_default();
    let mut weight = before;
    slider(ui, "measured light", &mut weight.0, 1.0);
    if weight != before {
        commands.entity(entity).insert(weight);
    }
}

fn name_of(entity: Entity, name: Option<&Name>) -> String {
    name.map_or_else(|| entity.to_string(), ToString::to_string)
}
