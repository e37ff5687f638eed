//! Phantoms and styles in extras.

use super::{
    component::FromExtras,
    fields::Fields,
    number_rules::{Albedo, FromZero, Number, Positive, Three, Whole},
    rules::{Flag, HexColor, Word},
};
use crate::{
    materials::{
        ClassicModel, ClassicStyle, CombinedModel, MeasuredLightWeight, MixedModel, PhongToon, SphereMapModel,
        StyleFade, SurfaceStyle, ToonKey, ToonModel, ToonStyle,
    },
    phantom::PhantomObject,
};
use bevy::prelude::*;

impl FromExtras for PhantomObject {
    const EXAMPLE: &'static str = r#"{"casts": true, "receives": true, "reflectance": [0.8, 0.8, 0.8]}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        let default = Self::default();
        Some(Self {
            casts: fields.optional("casts", Flag).unwrap_or(default.casts),
            receives: fields.optional("receives", Flag).unwrap_or(default.receives),
            reflectance: fields.optional("reflectance", Albedo),
        })
    }
}

impl FromExtras for SurfaceStyle {
    const EXAMPLE: &'static str =
        r##"{"Toon": {"bands": 3, "highlight": true, "outline_width": 2, "outline_color": "#000000"}}"##;
    const WORDS: &'static [(&'static str, fn() -> Self)] = &[
        ("ImageBased", || Self::ImageBased),
        ("Toon", || Self::Toon(default())),
        ("Classic", || Self::Classic(default())),
        ("Engine", || Self::Engine),
    ];

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        if fields.has("Classic") {
            return fields.required_object("Classic", "SurfaceStyle.Classic", |fields| Self::Classic(classic(fields)));
        }
        fields.required_object("Toon", "SurfaceStyle.Toon", |fields| Self::Toon(toon(fields)))
    }
}

impl FromExtras for StyleFade {
    const EXAMPLE: &'static str = r#"{"seconds": 0.5}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        let seconds = fields.optional("seconds", FromZero { max: MAX_FADE_SECONDS, unit: "seconds" });
        Some(seconds.map_or_else(Self::default, |seconds| Self { seconds }))
    }
}

impl FromExtras for MeasuredLightWeight {
    const EXAMPLE: &'static str = r#"{"weight": 0.2}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        fields.required("weight", FRACTION).map(Self)
    }
}

/// Reads a toon style. The coefficients of Phong's formula stand beside the name of the model.
fn toon(fields: &mut Fields) -> ToonStyle {
    let default = ToonStyle::default();
    let bands = Whole { min: ToonStyle::MIN_BANDS, max: ToonStyle::MAX_BANDS };
    let model = match fields.optional("model", Word(&["RoomLight", "Phong"])) {
        Some("Phong") => ToonModel::Phong(phong(fields)),
        _ => ToonModel::RoomLight,
    };
    let key = match fields.optional("key", Word(&["Prevailing", "StrongestRealLight", "Direction"])) {
        Some("StrongestRealLight") => ToonKey::StrongestRealLight,
        Some("Direction") => ToonKey::Direction(key_direction(fields)),
        _ => ToonKey::Prevailing,
    };
    let pixels = FromZero { max: ToonStyle::MAX_OUTLINE_WIDTH, unit: "pixels" };
    let meters = FromZero { max: ToonStyle::MAX_OUTLINE_METERS, unit: "meters" };
    ToonStyle {
        model,
        bands: fields.optional("bands", bands).unwrap_or(default.bands),
        key,
        softness: fields.optional("softness", FRACTION).unwrap_or(default.softness),
        highlight: fields.optional("highlight", Flag).unwrap_or(default.highlight),
        rim: fields.optional("rim", FRACTION).unwrap_or(default.rim),
        outline_width: fields.optional("outline_width", pixels).unwrap_or(default.outline_width),
        outline_meters: fields.optional("outline_meters", meters).unwrap_or(default.outline_meters),
        outline_color: fields.optional("outline_color", HexColor).unwrap_or(default.outline_color),
    }
}

fn key_direction(fields: &mut Fields) -> Vec3 {
    fields.required("key_direction", Three(Number { unit: "in any unit" })).unwrap_or_default()
}

fn phong(fields: &mut Fields) -> PhongToon {
    let default = PhongToon::default();
    let coefficient = || FromZero { max: ToonStyle::MAX_COEFFICIENT, unit: "a factor" };
    let exponent = FromZero { max: ToonStyle::MAX_EXPONENT, unit: "an exponent" };
    PhongToon {
        diffuse: fields.optional("diffuse", coefficient()).unwrap_or(default.diffuse),
        specular: fields.optional("specular", coefficient()).unwrap_or(default.specular),
        exponent: fields.optional("exponent", exponent).unwrap_or(default.exponent),
    }
}

/// Reads a classic style. The coefficients stand beside the name of the model; other models do not know them.
fn classic(fields: &mut Fields) -> ClassicStyle {
    let model = fields.optional("model", Word(&["GlossMap", "Combined", "Mixed", "SphereMap"]));
    let model = match model {
        Some("GlossMap") => ClassicModel::GlossMap,
        Some("Mixed") => ClassicModel::Mixed(mixed(fields)),
        Some("SphereMap") => ClassicModel::SphereMap(sphere_map(fields)),
        _ => ClassicModel::Combined(combined(fields)),
    };
    let default = ClassicStyle::default();
    let threshold = FromZero { max: ClassicStyle::MAX_REFLECTION_THRESHOLD, unit: "linear camera units" };
    ClassicStyle {
        model,
        roughness: fields.optional("roughness", FromZero { max: 1.0, unit: "perceptual roughness" }),
        refraction: fields.optional("refraction", Positive { max: ClassicStyle::MAX_REFRACTION, unit: None }),
        fresnel: fields.optional("fresnel", FRACTION),
        reflection_threshold: fields
            .optional("reflection_threshold", threshold)
            .unwrap_or(default.reflection_threshold),
    }
}

const COEFFICIENT: FromZero = FromZero { max: ClassicStyle::MAX_COEFFICIENT, unit: "a factor" };
/// Longer fades are mistakes.
const MAX_FADE_SECONDS: f32 = 60.0;
const FRACTION: FromZero = FromZero { max: 1.0, unit: "a fraction" };

fn combined(fields: &mut Fields) -> CombinedModel {
    let default = CombinedModel::default();
    let exponent = FromZero { max: ClassicStyle::MAX_EXPONENT, unit: "an exponent" };
    let ambient = FromZero { max: ClassicStyle::MAX_COEFFICIENT, unit: "linear camera units" };
    CombinedModel {
        ambient: fields.optional("ambient", ambient).unwrap_or(default.ambient),
        diffuse: fields.optional("diffuse", COEFFICIENT).unwrap_or(default.diffuse),
        specular: fields.optional("specular", COEFFICIENT).unwrap_or(default.specular),
        reflection: fields.optional("reflection", COEFFICIENT).unwrap_or(default.reflection),
        exponent: fields.optional("exponent", exponent).unwrap_or(default.exponent),
    }
}

fn mixed(fields: &mut Fields) -> MixedModel {
    let default = MixedModel::default();
    MixedModel {
        base: fields.optional("base", COEFFICIENT).unwrap_or(default.base),
        diffuse: fields.optional("diffuse", FRACTION).unwrap_or(default.diffuse),
        mirror: fields.optional("mirror", FRACTION).unwrap_or(default.mirror),
    }
}

fn sphere_map(fields: &mut Fields) -> SphereMapModel {
    let default = SphereMapModel::default();
    SphereMapModel {
        diffuse: fields.optional("diffuse", COEFFICIENT).unwrap_or(default.diffuse),
        mirror: fields.optional("mirror", COEFFICIENT).unwrap_or(default.mirror),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::authoring::{ExtrasProblem, component};
    use serde_json::{Map, Value, json};

    fn read_value<C: FromExtras>(component: &'static str, value: &Value) -> Result<C, Vec<ExtrasProblem>> {
        component::read_value(component, value, &Map::new())
    }

    #[test]
    fn the_weight_of_the_measured_light_is_a_fraction() {
        let read = |value| read_value::<MeasuredLightWeight>("MeasuredLightWeight", &value);
        assert_eq!(read(json!({"weight": 0.25})), Ok(MeasuredLightWeight(0.25)));
        for wrong in [json!({"weight": 2}), json!({}), json!(0.5)] {
            assert_eq!(read(wrong).map_err(|problems| problems.len()), Err(1));
        }
    }

    #[test]
    fn a_fade_has_seconds() {
        let read = |value| read_value::<StyleFade>("StyleFade", &value);
        assert_eq!(read(json!({"seconds": 1.5})), Ok(StyleFade { seconds: 1.5 }));
        assert_eq!(read(json!({})), Ok(StyleFade::default()));
        for wrong in [json!({"seconds": -1}), json!({"seconds": 61}), json!({"duration": 1}), json!(0.5)] {
            assert_eq!(read(wrong).map_err(|problems| problems.len()), Err(1));
        }
    }

    #[test]
    fn a_style_is_a_word_or_a_toon_with_details() {
        let toon = |toon| Ok(SurfaceStyle::Toon(toon));
        assert_eq!(read_value("SurfaceStyle", &json!("Toon")), toon(default()));
        assert_eq!(read_value("SurfaceStyle", &json!("Engine")), Ok(SurfaceStyle::Engine));
        assert_eq!(read_value("SurfaceStyle", &json!({"Toon": {}})), toon(default()));
        let details = json!({"Toon": {"bands": 4, "highlight": false, "outline_width": 0, "outline_color": "#ff8000"}});
        let outline_color = Color::srgb_u8(255, 128, 0);
        let expected = ToonStyle { bands: 4, highlight: false, outline_width: 0.0, outline_color, ..default() };
        assert_eq!(read_value("SurfaceStyle", &details), toon(expected));
    }

    #[test]
    fn a_toon_has_a_key_light_and_the_coefficients_of_its_model() {
        let read = |json: Value| read_value("SurfaceStyle", &json);
        let toon = |style| Ok(SurfaceStyle::Toon(style));
        let phong = PhongToon { diffuse: 0.8, specular: 0.3, exponent: 40.0 };
        let all = json!({"Toon": {
            "model": "Phong", "diffuse": 0.8, "specular": 0.3, "exponent": 40, "key": "Direction",
            "key_direction": [0, 2, 1], "softness": 0.5, "rim": 0.25, "outline_width": 0, "outline_meters": 0.01
        }});
        let expected = ToonStyle {
            model: ToonModel::Phong(phong),
            key: ToonKey::Direction(Vec3::new(0.0, 2.0, 1.0)),
            softness: 0.5,
            rim: 0.25,
            outline_width: 0.0,
            outline_meters: 0.01,
            ..default()
        };
        assert_eq!(read(all), toon(expected));
        let strongest = ToonStyle { key: ToonKey::StrongestRealLight, ..default() };
        assert_eq!(read(json!({"Toon": {"key": "StrongestRealLight"}})), toon(strongest));
    }

    #[test]
    fn a_classic_style_has_the_coefficients_of_its_model() {
        let read = |json: Value| read_value("SurfaceStyle", &json);
        let classic = |model| Ok(SurfaceStyle::Classic(ClassicStyle { model, ..default() }));
        assert_eq!(read(json!("Classic")), classic(default()));
        assert_eq!(read(json!({"Classic": {}})), classic(default()));
        assert_eq!(read(json!({"Classic": {"model": "GlossMap"}})), classic(ClassicModel::GlossMap));
        let model = MixedModel { base: 0.4, diffuse: 0.0, mirror: 1.0 };
        let mixed = json!({"Classic": {"model": "Mixed", "diffuse": 0, "mirror": 1}});
        assert_eq!(read(mixed), classic(ClassicModel::Mixed(model)));
        let model = SphereMapModel { diffuse: 0.5, mirror: 2.0 };
        let sphere_map = json!({"Classic": {"model": "SphereMap", "diffuse": 0.5, "mirror": 2}});
        assert_eq!(read(sphere_map), classic(ClassicModel::SphereMap(model)));
        let model = CombinedModel { ambient: 0.1, diffuse: 0.9, specular: 2.0, reflection: 0.3, exponent: 80.0 };
        let all = json!({"Classic": {
            "ambient": 0.1, "diffuse": 0.9, "specular": 2, "reflection": 0.3, "exponent": 80,
            "roughness": 0.2, "refraction": 0.95, "fresnel": 0.04, "reflection_threshold": 1
        }});
        let expected = ClassicStyle {
            model: ClassicModel::Combined(model),
            roughness: Some(0.2),
            refraction: Some(0.95),
            fresnel: Some(0.04),
            reflection_threshold: 1.0,
        };
        assert_eq!(read(all), Ok(SurfaceStyle::Classic(expected)));
    }

    #[test]
    fn mistakes_within_a_style_are_named_with_their_place() {
        let mistakes = [
            (json!({"Toon": {"bands": 9}}), "SurfaceStyle.Toon.bands is 9"),
            (json!({"Toon": {"outline_width": -1}}), "SurfaceStyle.Toon.outline_width is -1"),
            (json!({"Toon": {"outline_color": "black"}}), "SurfaceStyle.Toon.outline_color is \"black\""),
            (json!({"Toon": {"band": 3}}), "SurfaceStyle.Toon.band is unknown"),
            (json!({"Toon": {"softness": 2}}), "SurfaceStyle.Toon.softness is 2"),
            (json!({"Toon": {"key": "Sun"}}), "SurfaceStyle.Toon.key is \"Sun\""),
            (json!({"Toon": {"key": "Direction"}}), "SurfaceStyle.Toon.key_direction is missing"),
            (json!({"Toon": {"key_direction": [0, 1, 0]}}), "SurfaceStyle.Toon.key_direction is unknown"),
            (json!({"Toon": {"exponent": 9}}), "SurfaceStyle.Toon.exponent is unknown"),
            (json!({"Toon": {"outline_meters": 2}}), "SurfaceStyle.Toon.outline_meters is 2"),
            (json!({"Toon": 3}), "SurfaceStyle.Toon is 3"),
            (json!({}), "SurfaceStyle.Toon is missing"),
            (json!({"Tune": {}, "Toon": {}}), "SurfaceStyle.Tune is unknown"),
            (json!({"Classic": {"model": "Phong"}}), "SurfaceStyle.Classic.model is \"Phong\""),
            (json!({"Classic": {"model": "Mixed", "exponent": 9}}), "SurfaceStyle.Classic.exponent is unknown"),
            (json!({"Classic": {"refraction": 0}}), "SurfaceStyle.Classic.refraction is 0"),
            (json!({"Classic": {"fresnel": 1.5}}), "SurfaceStyle.Classic.fresnel is 1.5"),
            (json!({"Classic": {"reflection_threshold": -1}}), "SurfaceStyle.Classic.reflection_threshold is -1"),
            (json!({"Classic": {}, "Toon": {}}), "SurfaceStyle.Toon is unknown"),
        ];
        for (json, expected) in mistakes {
            let problems = read_value::<SurfaceStyle>("SurfaceStyle", &json).expect_err("a mistake");
            let text = problems[0].to_string();
            assert!(problems.len() == 1 && text.starts_with(expected), "{json}: {problems:?}, {text}");
        }
    }
}
