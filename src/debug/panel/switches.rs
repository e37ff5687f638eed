//! Controls of the panel: the map to show, and the style of each entity.

use super::toon_controls::draw_toon;
use crate::{
    debug::{MapView, ShownMap},
    materials::{ClassicStyle, SurfaceStyle, ToonStyle},
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

pub(super) type StyledEntity = (Entity, Option<&'static Name>, &'static mut SurfaceStyle);

pub(super) fn draw_styles(ui: &mut egui::Ui, styles: &mut Query<StyledEntity>) {
    let mut entities: Vec<_> = styles.iter_mut().collect();
    entities.sort_by(|(a, a_name, _), (b, b_name, _)| (a_name, a).cmp(&(b_name, b)));
    // As much as fits the width of the panel.
    egui::Grid::new("styles").num_columns(5).spacing([4.0, 4.0]).show(ui, |ui| {
        for (number, (entity, name, style)) in (1..).zip(&mut entities) {
            let name = name.map_or_else(|| entity.to_string(), ToString::to_string);
            ui.label(format!("{number} {name}"));
            let is_toon = matches!(**style, SurfaceStyle::Toon(_));
            if ui.selectable_label(is_toon, "toon").clicked() && !is_toon {
                **style = SurfaceStyle::Toon(ToonStyle::default());
            }
            let is_classic = matches!(**style, SurfaceStyle::Classic(_));
            if ui.selectable_label(is_classic, "classic").clicked() && !is_classic {
                **style = SurfaceStyle::Classic(ClassicStyle::default());
            }
            for (label, choice) in [("image-based", SurfaceStyle::ImageBased), ("Bevy", SurfaceStyle::Engine)] {
                if ui.selectable_label(**style == choice, label).clicked() {
                    style.set_if_neq(choice);
                }
            }
            ui.end_row();
        }
    });
    for (number, (entity, name, style)) in (1..).zip(&mut entities) {
        let name = name.map_or_else(|| entity.to_string(), ToString::to_string);
        if let Some(changed) = draw_toon(ui, &format!("{number} {name}: toon"), style) {
            style.set_if_neq(changed);
        }
    }
}
