//! The components that can be authored, and how each is read.

use super::{
    error::ExtrasProblem,
    fields::Fields,
    rules::{Albedo, Flag, HexColor, Pixels, Positive, Whole, Word, quoted, shown},
};
use crate::{
    materials::{SurfaceStyle, ToonStyle},
    phantom::PhantomObject,
    probe::{BallSurface, LightProbeSphere},
    shadows::{DomeCoverage, ShadowDomeLight, ShadowFilter, VisibilitySamples},
    tracking::{MarkerAnchor, MarkerFamily, WorldOrigin},
};
use bevy::prelude::*;
use serde_json::Value;

/// A component that can be read from the extras of a glTF node, where it stands under its own name.
pub(super) trait FromExtras: Component + Sized {
    /// A complete value, for messages.
    const EXAMPLE: &'static str;
    /// Plain strings that are accepted in place of an object, and their values.
    const WORDS: &'static [(&'static str, fn() -> Self)] = &[];

    /// Reads the component from the fields of an object. Returns `None` only if `fields` has noted a problem; the
    /// result may also contain defaults in that case.
    fn from_fields(fields: &mut Fields) -> Option<Self>;
}

/// Reads the value under the name `component`.
fn read_value<C: FromExtras>(component: &'static str, value: &Value) -> Result<C, Vec<ExtrasProblem>> {
    if let Some((_, make)) = value.as_str().and_then(|found| C::WORDS.iter().find(|(word, _)| *word == found)) {
        return Ok(make());
    }
    let Some(object) = value.as_object() else {
        let mut expected = format!("an object such as {}", C::EXAMPLE);
        if !C::WORDS.is_empty() {
            let words: Vec<_> = C::WORDS.iter().map(|(word, _)| *word).collect();
            expected = format!("{} or {expected}", quoted(&words));
        }
        return Err(vec![ExtrasProblem::WrongForm { component, found: shown(value), expected }]);
    };
    let mut fields = Fields::new(component, C::EXAMPLE, object);
    let read = C::from_fields(&mut fields);
    let problems = fields.into_problems();
    match read {
        Some(read) if problems.is_empty() => Ok(read),
        _ => Err(problems),
    }
}

/// Declares [`AuthoredComponent`]: each component's type name is its name in the extras.
macro_rules! authored_components {
    ($($(#[$doc:meta])* $component:ident),+ $(,)?) => {
        /// A component read from the extras of a glTF node.
        #[derive(Clone, Debug, PartialEq)]
        #[non_exhaustive]
        pub enum AuthoredComponent {
            $($(#[$doc])* $component($component),)+
        }

        impl AuthoredComponent {
            /// Names of all components that are read from extras.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($component)),+];

            /// Name of this component in extras.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$component(_) => stringify!($component),)+
                }
            }

            /// Inserts the component on an entity and replaces one of the same type. Does nothing if the entity no
            /// longer exists.
            pub fn insert_into(self, entity: &mut EntityCommands) {
                match self {
                    $(Self::$component(component) => entity.try_insert(component),)+
                };
            }

            /// Reads the value under `name`. Returns `None` if no component has that name.
            pub(super) fn read(name: &str, value: &Value) -> Option<Result<Self, Vec<ExtrasProblem>>> {
                match name {
                    $(stringify!($component) => Some(read_value(stringify!($component), value).map(Self::$component)),)+
                    _ => None,
                }
            }
        }
    };
}

authored_components! {
    /// A printed marker.
    MarkerAnchor,
    /// The marker that keeps its place in the world while the camera moves.
    WorldOrigin,
    /// The mirrored ball.
    LightProbeSphere,
    /// The stand-in for a real object.
    PhantomObject,
    /// The dome of shadow directions.
    ShadowDomeLight,
    /// The rendering style of a node and its descendants.
    SurfaceStyle,
}

/// Names of the marker families.
const FAMILIES: [&str; MarkerFamily::ALL.len()] = {
    let mut names = [""; MarkerFamily::ALL.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = MarkerFamily::ALL[i].name();
        i += 1;
    }
    names
};

impl FromExtras for MarkerAnchor {
    const EXAMPLE: &'static str = r#"{"id": 0, "size": 0.1}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        let family = choice(fields, "family", &FAMILIES, &MarkerFamily::ALL).unwrap_or_default();
        let id = fields.required("id", Whole { min: 0, max: family.marker_count() - 1 });
        let size = fields.required("size", Positive::METERS);
        Some(Self::new(id?, size?).with_family(family))
    }
}

impl FromExtras for WorldOrigin {
    const EXAMPLE: &'static str = "{}";

    fn from_fields(_: &mut Fields) -> Option<Self> {
        Some(Self)
    }
}

impl FromExtras for LightProbeSphere {
    const EXAMPLE: &'static str = r#"{"radius": 0.05, "reflectance": 0.9, "surface": "Mirror"}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        let default = Self::default();
        Some(Self {
            radius: fields.optional("radius", Positive::METERS).unwrap_or(default.radius),
            reflectance: fields.optional("reflectance", Positive::FRACTION).unwrap_or(default.reflectance),
            surface: match fields.optional("surface", Word(&["Mirror", "Dielectric"])) {
                Some("Dielectric") => BallSurface::Dielectric,
                _ => default.surface,
            },
        })
    }
}

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

/// Reads a field that holds the name of one of several values; `words` and `values` are in the same order.
fn choice<T: Copy>(fields: &mut Fields, name: &'static str, words: &'static [&'static str], values: &[T]) -> Option<T> {
    let word = fields.optional(name, Word(words))?;
    words.iter().position(|known| *known == word).and_then(|place| values.get(place).copied())
}

impl FromExtras for ShadowDomeLight {
    const EXAMPLE: &'static str = r#"{"directions": 64, "resolution": 256, "filter": "Gauss"}"#;

    fn from_fields(fields: &mut Fields) -> Option<Self> {
        use {DomeCoverage as Coverage, ShadowFilter as Filter, VisibilitySamples as Samples};
        let default = Self::default();
        let all = Whole { min: 1, max: Self::MAX_DIRECTIONS };
        let coverages = [Coverage::Hemisphere, Coverage::Sphere];
        let samples = [Samples::Interleaved, Samples::Half, Samples::Full, Samples::Fragment];
        let soft = Filter::Pcss { angular_radius: 0.1 };
        let filters =
            [Filter::Nearest, Filter::Bilinear, Filter::Gauss, Filter::Pcf9, Filter::Pcf25, Filter::Pcf49, soft];
        let filter_names = &["Nearest", "Bilinear", "Gauss", "Pcf9", "Pcf25", "Pcf49", "Pcss"];
        let mut filter = choice(fields, "filter", filter_names, &filters).unwrap_or(default.filter);
        if let (Filter::Pcss { angular_radius }, Some(given)) =
            (&mut filter, fields.optional("angular_radius", Positive::RADIANS))
        {
            *angular_radius = given;
        }
        Some(Self {
            directions: fields.optional("directions", all).unwrap_or(default.directions),
            coverage: choice(fields, "coverage", &["Hemisphere", "Sphere"], &coverages).unwrap_or(default.coverage),
            key_lights: fields
                .optional("key_lights", Whole { min: 0, max: Self::MAX_KEY_LIGHTS })
                .unwrap_or(default.key_lights),
            resolution: fields.optional("resolution", Whole { min: 32, max: 1024 }).unwrap_or(default.resolution),
            filter,
            samples: choice(fields, "samples", &["Interleaved", "Half", "Full", "Fragment"], &samples)
                .unwrap_or(default.samples),
            refreshed_per_frame: fields
                .optional("refreshed_per_frame", Whole { min: 1, max: Self::MAX_DIRECTIONS })
                .unwrap_or(default.refreshed_per_frame),
            dim_share: fields.optional("dim_share", Positive::FRACTION).unwrap_or(default.dim_share),
            occludes_reflections: fields.optional("occludes_reflections", Flag).unwrap_or(default.occludes_reflections),
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
            let width = Pixels { max: ToonStyle::MAX_OUTLINE_WIDTH };
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
    use serde_json::json;

    /// Example of a component that is an enum: a word, or an object with details.
    #[derive(Component, Debug, PartialEq)]
    enum Paint {
        Matte,
        Glossy { coats: u32 },
    }

    impl FromExtras for Paint {
        const EXAMPLE: &'static str = r#"{"coats": 2}"#;
        const WORDS: &'static [(&'static str, fn() -> Self)] =
            &[("Matte", || Self::Matte), ("Glossy", || Self::Glossy { coats: 1 })];

        fn from_fields(fields: &mut Fields) -> Option<Self> {
            Some(Self::Glossy { coats: fields.required("coats", Whole { min: 1, max: 9 })? })
        }
    }

    #[test]
    fn a_choice_may_be_a_word_or_an_object() {
        assert_eq!(read_value("Paint", &json!("Matte")), Ok(Paint::Matte));
        assert_eq!(read_value("Paint", &json!("Glossy")), Ok(Paint::Glossy { coats: 1 }));
        assert_eq!(read_value("Paint", &json!({"coats": 3})), Ok(Paint::Glossy { coats: 3 }));
    }

    #[test]
    fn a_wrong_word_is_answered_with_the_right_ones() {
        let problems = read_value::<Paint>("Paint", &json!("matte")).expect_err("no such word");
        let expected = r#""Matte" or "Glossy" or an object such as {"coats": 2}"#.to_string();
        assert_eq!(problems, [ExtrasProblem::WrongForm { component: "Paint", found: "\"matte\"".into(), expected }]);
    }

    #[test]
    fn every_example_is_accepted_and_complete() {
        fn check<C: FromExtras>() {
            let value = serde_json::from_str(C::EXAMPLE).expect("the example is JSON");
            assert!(read_value::<C>("example", &value).is_ok(), "{}", C::EXAMPLE);
        }
        check::<MarkerAnchor>();
        check::<WorldOrigin>();
        check::<LightProbeSphere>();
        check::<PhantomObject>();
        check::<ShadowDomeLight>();
        check::<SurfaceStyle>();
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
            let problems = read_value::<SurfaceStyle>("SurfaceStyle", &json).expect_err("a mistake");
            let text = problems[0].to_string();
            assert!(problems.len() == 1 && text.starts_with(expected), "{json}: {problems:?}, {text}");
        }
    }
}
