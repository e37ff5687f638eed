//! Switches of the panel for light from object to object and for the camera's grain.

use crate::{
    camera::ArCamera,
    materials::{CameraGrain, GrainMeasurement, NeighborReflections},
    shadows::ShadowDomeLight,
};
use bevy::{ecs::system::SystemParam, prelude::*};
use bevy_egui::egui;

type Camera = (Entity, Option<&'static mut CameraGrain>, Option<&'static GrainMeasurement>);

/// Settings of the effects.
#[derive(SystemParam)]
pub(super) struct Effects<'w, 's> {
    commands: Commands<'w, 's>,
    domes: Query<'w, 's, &'static mut ShadowDomeLight>,
    neighbors: Option<ResMut<'w, NeighborReflections>>,
    cameras: Query<'w, 's, Camera, With<ArCamera>>,
}

/// What a number becomes if it is switched: 0 is off.
fn switched(number: u32, default: u32) -> u32 {
    if number == 0 { default } else { 0 }
}

/// Draws a check box for a number of which 0 is off, and returns the number if it was clicked.
fn draw_switch(ui: &mut egui::Ui, label: &str, number: u32, default: u32) -> Option<u32> {
    let mut is_on = number > 0;
    ui.checkbox(&mut is_on, label).clicked().then(|| switched(number, default))
}

pub(super) fn draw_effects(ui: &mut egui::Ui, effects: &mut Effects) {
    for mut dome in &mut effects.domes {
        let default = ShadowDomeLight::default().surfels;
        if let Some(surfels) = draw_switch(ui, "bounced light", dome.surfels, default) {
            dome.surfels = surfels;
        }
    }
    if let Some(neighbors) = &mut effects.neighbors {
        let default = NeighborReflections::default().max_probes;
        if let Some(max_probes) = draw_switch(ui, "neighbors in mirrors", neighbors.max_probes, default) {
            neighbors.max_probes = max_probes;
        }
    }
    for (camera, grain, measured) in &mut effects.cameras {
        let mut is_on = grain.is_some();
        if ui.checkbox(&mut is_on, "noise and sharpness of the camera").clicked() {
            if is_on {
                effects.commands.entity(camera).insert(CameraGrain::default());
            } else {
                effects.commands.entity(camera).remove::<CameraGrain>();
            }
        }
        let Some(mut grain) = grain else { continue };
        let mut changed = *grain;
        ui.add(egui::Slider::new(&mut changed.noise, CameraGrain::STRENGTHS).text("noise"));
        ui.add(egui::Slider::new(&mut changed.blur, CameraGrain::STRENGTHS).text("width of edges"));
        grain.set_if_neq(changed);
        if let Some(measured) = measured {
            let noise = measured.noise(0.5).y * 255.0;
            let edges = measured.edge_width.map_or("not yet measured".to_owned(), |width| format!("{width:.2} pixels"));
            ui.label(format!("measured: noise of middle gray {noise:.1}/255, edges {edges}"));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_off_comes_back_with_its_default() {
        assert_eq!(switched(0, 512), 512);
        assert_eq!(switched(512, 512), 0);
        assert_eq!(switched(3, 4), 0);
    }
}
