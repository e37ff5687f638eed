//! Phantoms and styles in extras.

use super::{
    component::FromExtras,
    fields::Fields,
    number_rules::{Albedo, FromZero, Whole},
    rules::{Flag, HexColor},
};
use crate::{
    materials::{SurfaceStyle, ToonStyle},
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
    const WORDS: &'static [(&'static str, fn() -> Self)] =
        &[("ImageBased", || Self::ImageBased), ("Toon", || Self::Toon(default())), ("Engine", || Self::Engine)];

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        fields.required_object("Toon", "SurfaceStyle.Toon", |fields| {
            let default = ToonStyle::default();
            let bands = Whole { min: ToonStyle::MIN_BANDS, max: ToonStyle::MAX_BANDS };
            let width = FromZero { max: ToonStyle::MAX_OUTLINE_WIDTH, unit: "pixels" };
            Self::Toon(ToonStyle {
                bands: fields.optional("bands", bands).unwrap_or(default.bands),
                highlight: fields.optional("highlight", Flag).unwrap_or(default.highlight),
                outline_width: fields.optional("outline_width", width).unwrap_or(default.outline_width),
                outline_color: fields.optional("outline_color", HexColor).unwrap_or(default.outline_color),
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::authoring::{ExtrasProblem, component};
    use serde_json::{Map, Value, json};

    fn read_value(component: &'static str, value: &Value) -> Result<SurfaceStyle, Vec<ExtrasProblem>> {
        component::read_value(component, value, &Map::new())
    }

    #[test]
    fn a_style_is_a_word_or_a_toon_with_details() {
        let toon = |toon| Ok(SurfaceStyle::Toon(toon));
        assert_eq!(read_value("SurfaceStyle", &json!("Toon")), toon(default()));
        assert_eq!(read_value("SurfaceStyle", &json!("Engine")), Ok(SurfaceStyle::Engine));
        assert_eq!(read_value("SurfaceStyle", &json!({"Toon": {}})), toon(default()));
        let details = json!({"Toon": {"bands": 4, "highlight": false, "outline_width": 0, "outline_color": "#ff8000"}});
        let outline_color = Color::srgb_u8(255, 128, 0);
        let expected = ToonStyle { bands: 4, highlight: false, outline_width: 0.0, outline_color };
        assert_eq!(read_value("SurfaceStyle", &details), toon(expected));
    }

    #[test]
    fn mistakes_within_a_toon_are_named_with_their_place() {
        let mistakes = [
            (json!({"Toon": {"bands": 9}}), "SurfaceStyle.Toon.bands is 9"),
            (json!({"Toon": {"outline_width": -1}}), "SurfaceStyle.Toon.outline_width is -1"),
            (json!({"Toon": {"outline_color": "black"}}), "SurfaceStyle.Toon.outline_color is \"black\""),
            (json!({"Toon": {"band": 3}}), "SurfaceStyle.Toon.band is unknown"),
            (json!({"Toon": 3}), "SurfaceStyle.Toon is 3"),
            (json!({}), "SurfaceStyle.Toon is missing"),
            (json!({"Tune": {}, "Toon": {}}), "SurfaceStyle.Tune is unknown"),
        ];
        for (json, expected) in mistakes {
            let problems = read_value("SurfaceStyle", &json).expect_err("a mistake");
            let text = problems[0].to_string();
            assert!(problems.len() == 1 && text.starts_with(expected), "{json}: {problems:?}, {text}");
        }
    }
}
