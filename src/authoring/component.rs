//! The components that can be authored, and how each is read.

use super::{
    error::ExtrasProblem,
    fields::Fields,
    rules::{Word, quoted, shown},
};
use crate::{
    materials::{MeasuredLightWeight, StyleFade, SurfaceStyle},
    phantom::PhantomObject,
    probe::{ClipRecovery, LightProbeSphere},
    shadows::{PlanarShadow, ShadowDomeLight},
    tracking::{MarkerAnchor, MarkerBoard, PoseFilter, VirtualButton, WorldOrigin},
};
use bevy::prelude::*;
use serde_json::{Map, Value};

/// A component that can be read from the extras of a glTF node, where it stands under its own name.
pub(super) trait FromExtras: Component + Sized {
    /// A complete value, for messages.
    const EXAMPLE: &'static str;
    /// Plain strings that are accepted in place of an object, and their values.
    const WORDS: &'static [(&'static str, fn() -> Self)] = &[];

    /// Reads the component from the fields of an object. Returns `None` only if `fields` has noted a problem, or if
    /// another component that it is made of has one; the result may also contain defaults in that case.
    fn from_fields(fields: &mut Fields) -> Option<Self>;
}

/// Reads the value under the name `component`, which stands among the extras `beside`. Returns an error without
/// problems if the reason is a mistake in another component, which is reported there.
pub(super) fn read_value<C: FromExtras>(
    component: &'static str,
    value: &Value,
    beside: &Map<String, Value>,
) -> Result<C, Vec<ExtrasProblem>> {
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
    let mut fields = Fields::new(component, C::EXAMPLE, object, beside);
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

            /// Reads the value under `name` in `extras`. Returns `None` if no component has that name.
            pub(super) fn read(name: &str, extras: &Map<String, Value>) -> Option<Result<Self, Vec<ExtrasProblem>>> {
                let value = extras.get(name)?;
                match name {
                    $(stringify!($component) => {
                        Some(read_value(stringify!($component), value, extras).map(Self::$component))
                    })+
                    _ => None,
                }
            }
        }
    };
}

authored_components! {
    /// A printed marker.
    MarkerAnchor,
    /// Further markers that are fixed to the marker.
    MarkerBoard,
    /// The smoothing of the marker's poses.
    PoseFilter,
    /// The marker that keeps its place in the world while the camera moves.
    WorldOrigin,
    /// A button printed on the sheet of a marker.
    VirtualButton,
    /// The mirrored ball.
    LightProbeSphere,
    /// The recovery of what the camera clips of the ball's light.
    ClipRecovery,
    /// The stand-in for a real object.
    PhantomObject,
    /// The dome of shadow directions.
    ShadowDomeLight,
    /// The shadows on a flat receiver.
    PlanarShadow,
    /// The rendering style of a node and its descendants.
    SurfaceStyle,
    /// The time in which a node and its descendants fade from one style to the next.
    StyleFade,
    /// How much of the measured light a node and its descendants receive.
    MeasuredLightWeight,
}

/// Reads a field that holds the name of one of several values; `words` and `values` are in the same order.
pub(super) fn choice<T: Copy>(
    fields: &mut Fields,
    name: &'static str,
    words: &'static [&'static str],
    values: &[T],
) -> Option<T> {
    let word = fields.optional(name, Word(words))?;
    words.iter().position(|known| *known == word).and_then(|place| values.get(place).copied())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::authoring::number_rules::Whole;
    use serde_json::json;

    /// Reads a component that stands alone.
    fn read_value<C: FromExtras>(component: &'static str, value: &Value) -> Result<C, Vec<ExtrasProblem>> {
        super::read_value(component, value, &Map::new())
    }

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
            let anchor = serde_json::from_str(MarkerAnchor::EXAMPLE).expect("the example is JSON");
            let beside = Map::from_iter([("MarkerAnchor".to_string(), anchor)]);
            assert!(super::read_value::<C>("example", &value, &beside).is_ok(), "{}", C::EXAMPLE);
        }
        check::<MarkerAnchor>();
        check::<MarkerBoard>();
        check::<PoseFilter>();
        check::<WorldOrigin>();
        check::<VirtualButton>();
        check::<LightProbeSphere>();
        check::<ClipRecovery>();
        check::<PhantomObject>();
        check::<ShadowDomeLight>();
        check::<PlanarShadow>();
        check::<SurfaceStyle>();
        check::<StyleFade>();
        check::<MeasuredLightWeight>();
    }
}
