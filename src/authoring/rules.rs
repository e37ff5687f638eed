//! Rules that check and convert the JSON value of one field.

use bevy::color::{Color, Srgba};
use serde_json::{Map, Value};

/// A rule for the value of a field.
pub(super) trait Rule {
    /// Rust type of the accepted values.
    type Value;
    /// Converts the JSON value, or says in which way it does not match.
    fn read(&self, json: &Value) -> Result<Self::Value, Mismatch>;
    /// Describes the accepted values in words that can follow "write" or "expected".
    fn expected(&self) -> String;
}

/// Why a rule rejects a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mismatch {
    /// The value has another JSON type.
    Type,
    /// The value has the right type, but is not accepted.
    Range,
}

/// `true` or `false`.
pub(super) struct Flag;

impl Rule for Flag {
    type Value = bool;

    fn read(&self, json: &Value) -> Result<bool, Mismatch> {
        json.as_bool().ok_or(Mismatch::Type)
    }

    fn expected(&self) -> String {
        "true or false".into()
    }
}

/// An sRGB color in the hexadecimal notation of web pages.
pub(super) struct HexColor;

impl Rule for HexColor {
    type Value = Color;

    fn read(&self, json: &Value) -> Result<Color, Mismatch> {
        let text = json.as_str().ok_or(Mismatch::Type)?;
        Srgba::hex(text).map(Color::from).map_err(|_| Mismatch::Range)
    }

    fn expected(&self) -> String {
        "a color such as \"#ff8000\"".into()
    }
}

/// One of a few words, case-sensitive.
pub(super) struct Word(pub(super) &'static [&'static str]);

impl Rule for Word {
    type Value = &'static str;

    fn read(&self, json: &Value) -> Result<&'static str, Mismatch> {
        let found = json.as_str().ok_or(Mismatch::Type)?;
        self.0.iter().find(|&&word| word == found).copied().ok_or(Mismatch::Range)
    }

    fn expected(&self) -> String {
        quoted(self.0)
    }
}

/// An object with fields of its own.
pub(super) struct Object;

impl Rule for Object {
    type Value = Map<String, Value>;

    fn read(&self, json: &Value) -> Result<Self::Value, Mismatch> {
        json.as_object().cloned().ok_or(Mismatch::Type)
    }

    fn expected(&self) -> String {
        "an object, {} for the defaults".into()
    }
}

/// A list of objects with fields of their own.
pub(super) struct List;

impl Rule for List {
    type Value = Vec<Map<String, Value>>;

    fn read(&self, json: &Value) -> Result<Self::Value, Mismatch> {
        let values = json.as_array().ok_or(Mismatch::Type)?;
        values.iter().map(|value| value.as_object().cloned().ok_or(Mismatch::Type)).collect()
    }

    fn expected(&self) -> String {
        "a list of objects".into()
    }
}

/// Returns the words in quotes, joined by "or".
pub(super) fn quoted(words: &[&str]) -> String {
    words.iter().map(|word| format!("{word:?}")).collect::<Vec<_>>().join(" or ")
}

/// Largest number of characters of a user's value that a message repeats.
const MAX_SHOWN_CHARACTERS: usize = 40;

/// Formats a value for a message, as JSON that is truncated if it is long.
pub(super) fn shown(json: &Value) -> String {
    let text = json.to_string();
    match text.char_indices().nth(MAX_SHOWN_CHARACTERS) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn long_values_are_cut_between_characters() {
        assert_eq!(shown(&json!(-0.5)), "-0.5");
        let long = shown(&json!("ä".repeat(100)));
        assert_eq!(long.chars().count(), MAX_SHOWN_CHARACTERS + 1);
        assert!(long.ends_with('…'));
    }
}
