//! Rules that check and convert the JSON value of one field.

use bevy::{
    color::{Color, Srgba},
    math::Vec3,
};
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

/// A whole number from `min` to `max`. Some tools write whole numbers with a decimal point, so that 64.0 is accepted as
/// 64.
pub(super) struct Whole {
    pub(super) min: u32,
    pub(super) max: u32,
}

impl Rule for Whole {
    type Value = u32;

    fn read(&self, json: &Value) -> Result<u32, Mismatch> {
        let number = json.as_f64().filter(|number| number.fract() == 0.0).ok_or(Mismatch::Type)?;
        // Both limits are exact in f64, so the cast is too.
        let in_range = (f64::from(self.min)..=f64::from(self.max)).contains(&number);
        in_range.then_some(number as u32).ok_or(Mismatch::Range)
    }

    fn expected(&self) -> String {
        format!("a whole number from {} to {}", self.min, self.max)
    }
}

/// A finite number above 0 and at most `max`, in single precision too.
pub(super) struct Positive {
    pub(super) max: f32,
    pub(super) unit: Option<&'static str>,
}

impl Positive {
    /// A length in meters.
    pub(super) const METERS: Self = Self { max: f32::MAX, unit: Some("meters") };
    /// An angle in radians, below a right angle.
    pub(super) const RADIANS: Self = Self { max: 1.5, unit: Some("radians") };
    /// A fraction.
    pub(super) const FRACTION: Self = Self { max: 1.0, unit: None };
}

impl Rule for Positive {
    type Value = f32;

    fn read(&self, json: &Value) -> Result<f32, Mismatch> {
        let number = json.as_f64().ok_or(Mismatch::Type)? as f32;
        (number > 0.0 && number <= self.max).then_some(number).ok_or(Mismatch::Range)
    }

    fn expected(&self) -> String {
        let mut text = String::from("a number above 0");
        if self.max < f32::MAX {
            text.push_str(&format!(" and at most {}", self.max));
        }
        if let Some(unit) = self.unit {
            text.push_str(&format!(" ({unit})"));
        }
        text
    }
}

/// Albedo: the fractions of red, green and blue light that a surface reflects, as three numbers or one for all.
pub(super) struct Albedo;

impl Rule for Albedo {
    type Value = Vec3;

    fn read(&self, json: &Value) -> Result<Vec3, Mismatch> {
        if json.is_number() {
            return Positive::FRACTION.read(json).map(Vec3::splat);
        }
        let numbers = json.as_array().filter(|numbers| numbers.len() == 3).ok_or(Mismatch::Type)?;
        let channel = |i: usize| Positive::FRACTION.read(&numbers[i]);
        Ok(Vec3::new(channel(0)?, channel(1)?, channel(2)?))
    }

    fn expected(&self) -> String {
        "a number above 0 and at most 1, or three of them for red, green and blue (linear)".into()
    }
}

/// A number of pixels from 0 to `max`.
pub(super) struct Pixels {
    pub(super) max: f32,
}

impl Rule for Pixels {
    type Value = f32;

    fn read(&self, json: &Value) -> Result<f32, Mismatch> {
        let number = json.as_f64().ok_or(Mismatch::Type)? as f32;
        (0.0..=self.max).contains(&number).then_some(number).ok_or(Mismatch::Range)
    }

    fn expected(&self) -> String {
        format!("a number from 0 to {} (pixels)", self.max)
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
    fn whole_numbers_stay_in_their_range() {
        let rule = Whole { min: 1, max: 256 };
        assert_eq!(rule.read(&json!(1)), Ok(1));
        assert_eq!(rule.read(&json!(256.0)), Ok(256));
        for outside in [json!(0), json!(-1), json!(257), json!(1e300)] {
            assert_eq!(rule.read(&outside), Err(Mismatch::Range), "{outside}");
        }
        for other in [json!(1.5), json!("1"), json!(true), json!(null)] {
            assert_eq!(rule.read(&other), Err(Mismatch::Type), "{other}");
        }
    }

    #[test]
    fn positive_numbers_are_positive_in_single_precision_too() {
        assert_eq!(Positive::METERS.read(&json!(0.05)), Ok(0.05));
        assert_eq!(Positive::METERS.read(&json!(2)), Ok(2.0));
        // As f32, 1e-60 becomes 0 and 1e60 infinite.
        for outside in [json!(0), json!(-0.1), json!(1e-60), json!(1e60)] {
            assert_eq!(Positive::METERS.read(&outside), Err(Mismatch::Range), "{outside}");
        }
        assert_eq!(Positive::FRACTION.read(&json!(1)), Ok(1.0));
        assert_eq!(Positive::FRACTION.read(&json!(1.01)), Err(Mismatch::Range));
        assert_eq!(Positive::FRACTION.read(&json!("0.9")), Err(Mismatch::Type));
    }

    #[test]
    fn albedos_are_one_fraction_or_three() {
        assert_eq!(Albedo.read(&json!(0.8)), Ok(Vec3::splat(0.8)));
        assert_eq!(Albedo.read(&json!([0.8, 0.5, 1])), Ok(Vec3::new(0.8, 0.5, 1.0)));
        for outside in [json!(0), json!(1.2), json!([0.8, 0.0, 0.5])] {
            assert_eq!(Albedo.read(&outside), Err(Mismatch::Range), "{outside}");
        }
        for other in [json!("white"), json!([0.8, 0.5]), json!([0.8, 0.5, "1"])] {
            assert_eq!(Albedo.read(&other), Err(Mismatch::Type), "{other}");
        }
    }

    #[test]
    fn long_values_are_cut_between_characters() {
        assert_eq!(shown(&json!(-0.5)), "-0.5");
        let long = shown(&json!("ä".repeat(100)));
        assert_eq!(long.chars().count(), MAX_SHOWN_CHARACTERS + 1);
        assert!(long.ends_with('…'));
    }
}
