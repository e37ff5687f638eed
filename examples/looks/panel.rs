//! The panel: every parameter of the selected thing's look, and the file of all looks.

use crate::{
    look::{Look, Looks, Things, show},
    presets,
    ramps::Ramp,
    styles_file,
    window::Selected,
};
use bevy::prelude::*;
use bevy_egui::{EguiContexts, egui};
use bevy_mirrorball::{debug::edit_surface_style, prelude::*};
use std::path::{Path, PathBuf};

const RAMPS: [(&str, Ramp); 3] = [("comic", Ramp::Comic), ("dusk", Ramp::Dusk), ("ring", Ramp::Ring)];

/// The file of `save` and `load`, and what came of it last.
#[derive(Resource)]
pub(crate) struct StylesFile {
    path: PathBuf,
    outcome: Result<String, String>,
}

impl StylesFile {
    pub(crate) fn new(path: Option<&Path>) -> Self {
        Self { path: path.unwrap_or(Path::new("looks.ron")).to_owned(), outcome: Ok(String::new()) }
    }
}

pub(crate) fn draw_panel(
    mut contexts: EguiContexts,
    mut selected: ResMut<Selected>,
    mut file: ResMut<StylesFile>,
    mut things: Things,
) -> Result {
    let ctx = contexts.ctx_mut()?;
    let largest = ctx.viewport_rect().height() - 60.0;
    let panel = egui::Window::new("looks").anchor(egui::Align2::RIGHT_TOP, [-8.0, 8.0]).resizable(false);
    panel.show(ctx, |ui| {
        egui::ScrollArea::vertical().max_height(largest).min_scrolled_height(largest).show(ui, |ui| {
            draw_file(ui, &mut file, &mut things);
            ui.separator();
            choose_thing(ui, &mut selected, &things);
            edit_selected(ui, &selected, &mut things);
        });
    });
    Ok(())
}

fn draw_file(ui: &mut egui::Ui, file: &mut StylesFile, things: &mut Things) {
    ui.horizontal(|ui| {
        let path = file.path.display().to_string();
        if ui.button("save").clicked() {
            let look = |(_, name, style, ramps, light): (_, &Name, &SurfaceStyle, &_, &_)| {
                (name.to_string(), Look { style: *style, ramps: *ramps, measured_light: *light })
            };
            let looks: Looks = things.iter().map(look).collect();
            file.outcome = styles_file::save(&looks, &file.path).map(|()| format!("saved to {path}"));
        }
        if ui.button("load").clicked() {
            file.outcome = styles_file::load(&file.path).map(|looks| {
                show(things, &looks);
                format!("loaded from {path}")
            });
        }
        ui.label(path);
    });
    let (said, color) = match &file.outcome {
        Ok(done) => (done, ui.visuals().text_color()),
        Err(problem) => (problem, egui::Color32::from_rgb(240, 90, 80)),
    };
    if !said.is_empty() {
        ui.colored_label(color, said);
    }
}

fn choose_thing(ui: &mut egui::Ui, selected: &mut Selected, things: &Things) {
    ui.horizontal(|ui| {
        for (thing, name, ..) in things {
            let is_selected = selected.0 == Some(thing);
            if ui.selectable_label(is_selected, name.as_str()).clicked() {
                selected.0 = Some(thing);
            }
        }
    });
}

fn edit_selected(ui: &mut egui::Ui, selected: &Selected, things: &mut Things) {
    let thing = selected.0.and_then(|thing| things.get_mut(thing).ok());
    let Some((.., mut style, mut ramps, mut measured_light)) = thing else {
        ui.label("Click a thing in the picture. Space holds the camera.");
        return;
    };
    let mut look = Look { style: *style, ramps: *ramps, measured_light: *measured_light };
    edit_look(ui, &mut look);
    // Only what has changed is prepared anew.
    style.set_if_neq(look.style);
    ramps.set_if_neq(look.ramps);
    measured_light.set_if_neq(look.measured_light);
}

fn edit_look(ui: &mut egui::Ui, look: &mut Look) {
    ui.menu_button("start from …", |ui| {
        for name in presets::NAMES {
            if ui.button(name).clicked() {
                *look = presets::named(name).unwrap_or_default();
            }
        }
    });
    edit_surface_style(ui, &mut look.style);
    if let SurfaceStyle::Toon(_) = look.style {
        ui.strong("ramps");
        choose_ramp(ui, "light", &mut look.ramps.diffuse);
        choose_ramp(ui, "highlight", &mut look.ramps.specular);
    }
    ui.separator();
    // What nobody drags stays as it is.
    let weight = egui::Slider::new(&mut look.measured_light.0, 0.0..=1.0).clamping(egui::SliderClamping::Edits);
    ui.add(weight.max_decimals(3).text("measured light"));
}

fn choose_ramp(ui: &mut egui::Ui, label: &str, ramp: &mut Option<Ramp>) {
    let chosen = RAMPS.into_iter().find(|(_, known)| Some(*known) == *ramp).map_or("none", |(name, _)| name);
    egui::ComboBox::from_label(label).selected_text(chosen).show_ui(ui, |ui| {
        ui.selectable_value(ramp, None, "none");
        for (name, known) in RAMPS {
            ui.selectable_value(ramp, Some(known), name);
        }
    });
}
