//! Controls for everything that a surface style has.

use super::{classic_controls::edit_classic, toon_controls::edit_toon};
use crate::materials::SurfaceStyle;
use bevy::prelude::*;
use bevy_egui::egui;

/// Draws controls for the kind of a style, and all its settings. Those stay as they are while the kind is chosen again;
/// another kind starts with its defaults.
///
/// ```no_run
/// # use bevy::prelude::*;
/// # use bevy_egui::{EguiContexts, egui};
/// # use bevy_mirrorball::{debug::edit_surface_style, prelude::*};
/// // in a game's own panel
/// fn draw_panel(mut contexts: EguiContexts, mut style: Single<&mut SurfaceStyle>) -> Result {
///     egui::Window::new("hero").show(contexts.ctx_mut()?, |ui| {
///         let mut edited = **style;
///         edit_surface_style(ui, &mut edited);
///         style.set_if_neq(edited);
///     });
///     Ok(())
/// }
/// ```
pub fn edit_surface_style(ui: &mut egui::Ui, style: &mut SurfaceStyle) {
    ui.horizontal(|ui| choose_kind(ui, style));
    edit_settings(ui, style);
}

/// Draws a label for each kind of style.
pub(super) fn choose_kind(ui: &mut egui::Ui, style: &mut SurfaceStyle) {
    let toon = if let SurfaceStyle::Toon(toon) = *style { toon } else { default() };
    let classic = if let SurfaceStyle::Classic(classic) = *style { classic } else { default() };
    for (name, kind) in [
        ("toon", SurfaceStyle::Toon(toon)),
        ("classic", SurfaceStyle::Classic(classic)),
        ("image-based", SurfaceStyle::ImageBased),
        ("Bevy", SurfaceStyle::Engine),
    ] {
        ui.selectable_value(style, kind, name);
    }
}

pub(super) fn edit_settings(ui: &mut egui::Ui, style: &mut SurfaceStyle) {
    match style {
        SurfaceStyle::Toon(toon) => edit_toon(ui, toon),
        SurfaceStyle::Classic(classic) => edit_classic(ui, classic),
        SurfaceStyle::ImageBased | SurfaceStyle::Engine => {}
    }
}

/// Draws a slider from 0 on, with its name.
pub(super) fn slider(ui: &mut egui::Ui, name: &str, value: &mut f32, largest: f32) {
    ui.add(calm(egui::Slider::new(value, 0.0..=largest)).max_decimals(3).text(name));
}

/// The same with more room for small values: those from a thousandth of the largest on.
pub(super) fn wide_slider(ui: &mut egui::Ui, name: &str, value: &mut f32, largest: f32) {
    let slider = calm(egui::Slider::new(value, 0.0..=largest)).logarithmic(true);
    ui.add(slider.smallest_positive(0.001 * f64::from(largest)).max_decimals(4).text(name));
}

/// Lets a slider leave a value alone that nobody drags, whether or not it is within the range and how many decimals it
/// has.
pub(super) fn calm(slider: egui::Slider) -> egui::Slider {
    slider.clamping(egui::SliderClamping::Edits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::materials::{
        ClassicModel, ClassicStyle, CombinedModel, MixedModel, PhongToon, ToonKey, ToonModel, ToonStyle,
    };

    #[test]
    fn looking_at_a_style_changes_nothing() {
        // More decimals than a slider shows, and more than it goes to.
        let odd = 0.123_456_78;
        let toon = ToonStyle {
            model: ToonModel::Phong(PhongToon { diffuse: odd, specular: 1e6, exponent: -odd }),
            bands: 99,
            key: ToonKey::Direction(Vec3::new(0.0, 2.0, odd)),
            softness: odd,
            rim: 7.0,
            outline_width: odd,
            outline_meters: 0.000_123_4,
            outline_color: Color::linear_rgb(0.1, 0.2, 0.3),
            ..default()
        };
        let combined = CombinedModel { ambient: odd, diffuse: -1.0, specular: 1e6, reflection: odd, exponent: 1e9 };
        let mixed = MixedModel { base: odd, diffuse: 3.0, mirror: odd };
        let classic = |model| ClassicStyle {
            model,
            roughness: Some(odd),
            refraction: Some(9.0),
            fresnel: Some(-odd),
            reflection_threshold: odd,
        };
        let models = [ClassicModel::GlossMap, ClassicModel::Combined(combined), ClassicModel::Mixed(mixed)];
        let classics = models.map(|model| SurfaceStyle::Classic(classic(model)));
        let others = [SurfaceStyle::Toon(toon), SurfaceStyle::ImageBased, SurfaceStyle::Engine];
        for style in classics.into_iter().chain(others) {
            let mut edited = style;
            egui::__run_test_ui(|ui| edit_surface_style(ui, &mut edited));
            assert_eq!(edited, style);
        }
    }
}
