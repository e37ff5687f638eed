//! Rules for numbers and lists of numbers.

use super::rules::{Mismatch, Rule};
use bevy::math::{Vec2, Vec3};
use serde_json::Value;

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
    /// A frequency in hertz.
    pub(super) const HERTZ: Self = Self { max: f32::MAX, unit: Some("Hz") };
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
        Three(Positive::FRACTION).read(json)
    }

    fn expected(&self) -> String {
        "a number above 0 and at most 1, or three of them for red, green and blue (linear)".into()
    }
}

/// A number from 0 to `max`.
pub(super) struct FromZero {
    pub(super) max: f32,
    pub(super) unit: &'static str,
}

impl Rule for FromZero {
    type Value = f32;

    fn read(&self, json: &Value) -> Result<f32, Mismatch> {
        let number = json.as_f64().ok_or(Mismatch::Type)? as f32;
        (0.0..=self.max).contains(&number).then_some(number).ok_or(Mismatch::Range)
    }

    fn expected(&self) -> String {
        format!("a number from 0 to {} ({})", self.max, self.unit)
    }
}

/// A finite number, in single precision too.
pub(super) struct Number {
    pub(super) unit: &'static str,
}

impl Rule for Number {
    type Value = f32;

    fn read(&self, json: &Value) -> Result<f32, Mismatch> {
        let number = json.as_f64().ok_or(Mismatch::Type)? as f32;
        number.is_finite().then_some(number).ok_or(Mismatch::Range)
    }

    fn expected(&self) -> String {
        format!("a number ({})", self.unit)
    }
}

/// Three numbers along x, y and z, each by one rule.
pub(super) struct Three<R>(pub(super) R);

impl<R: Rule<Value = f32>> Rule for Three<R> {
    type Value = Vec3;

    fn read(&self, json: &Value) -> Result<Vec3, Mismatch> {
        let numbers = json.as_array().filter(|numbers| numbers.len() == 3).ok_or(Mismatch::Type)?;
        Ok(Vec3::new(self.0.read(&numbers[0])?, self.0.read(&numbers[1])?, self.0.read(&numbers[2])?))
    }

    fn expected(&self) -> String {
        format!("a list of three, for x, y and z, each {}", self.0.expected())
    }
}

/// Two numbers along x and z, each by one rule.
pub(super) struct Two<R>(pub(super) R);

impl<R: Rule<Value = f32>> Rule for Two<R> {
    type Value = Vec2;

    fn read(&self, json: &Value) -> Result<Vec2, Mismatch> {
        let numbers = json.as_array().filter(|numbers| numbers.len() == 2).ok_or(Mismatch::Type)?;
        Ok(Vec2::new(self.0.read(&numbers[0])?, self.0.read(&numbers[1])?))
    }

    fn expected(&self) -> String {
        format!("a list of two, for x and z, each {}", self.0.expected())
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
    fn three_numbers_are_three_finite_ones() {
        let rule = Three(Number { unit: "meters" });
        assert_eq!(rule.read(&json!([0.1, 0, -2.5])), Ok(Vec3::new(0.1, 0.0, -2.5)));
        assert_eq!(rule.read(&json!([0.1, 0, 1e60])), Err(Mismatch::Range));
        for other in [json!([0.1, 0]), json!([0.1, 0, "1"]), json!(0.1), json!([1, 2, 3, 4])] {
            assert_eq!(rule.read(&other), Err(Mismatch::Type), "{other}");
        }
        assert_eq!(rule.expected(), "a list of three, for x, y and z, each a number (meters)");
    }
}
