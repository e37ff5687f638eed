//! Controls of the panel for toon surfaces.

use crate::materials::{SurfaceStyle, ToonKey, ToonStyle};
use bevy_egui::egui;

/// Draws the settings of a toon style, closed until they are wanted. Draws nothing for other styles.
pub(super) fn draw_toon(ui: &mut egui::Ui, title: &str, style: &SurfaceStyle) -> Option<SurfaceStyle> {
    let SurfaceStyle::Toon(before) = *style else {
        return None;
    };
    let mut toon = before;
    ui.collapsing(title, |ui| {
        ui.add(egui::Slider::new(&mut toon.bands, ToonStyle::MIN_BANDS..=ToonStyle::MAX_BANDS).text("bands"));
        ui.add(egui::Slider::new(&mut toon.softness, 0.0..=1.0).text("softness"));
        ui.add(egui::Slider::new(&mut toon.rim, 0.0..=1.0).text("rim light"));
        ui.add(egui::Slider::new(&mut toon.outline_width, 0.0..=10.0).text("outline, pixels"));
        ui.add(egui::Slider::new(&mut toon.outline_meters, 0.0..=0.02).text("outline, meters"));
        ui.checkbox(&mut toon.highlight, "highlight");
        ui.horizontal(|ui| {
            for (key, name) in
                [(ToonKey::Prevailing, "prevailing light"), (ToonKey::StrongestRealLight, "strongest real light")]
            {
                ui.radio_value(&mut toon.key, key, name);
            }
        });
    });
    (toon != before).then_some(SurfaceStyle::Toon(toon))
}
