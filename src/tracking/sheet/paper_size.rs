//! Sizes of paper.

use crate::tracking::TrackingError;
use bevy::math::Vec2;
use std::str::FromStr;

/// Width and height of a page.
///
/// ```
/// # use bevy_mirrorball::tracking::PaperSize;
/// assert_eq!("A4-landscape".parse(), Ok(PaperSize::A4.landscape()));
/// assert_eq!("200x150".parse(), Ok(PaperSize::new(200.0, 150.0)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperSize {
    /// Width in millimeters. Finite and above 0.
    pub width: f32,
    /// Height in millimeters. Finite and above 0.
    pub height: f32,
}

impl PaperSize {
    /// 148 × 210 mm.
    pub const A5: Self = Self::new(148.0, 210.0);
    /// 210 × 297 mm.
    pub const A4: Self = Self::new(210.0, 297.0);
    /// 297 × 420 mm.
    pub const A3: Self = Self::new(297.0, 420.0);
    /// 8.5 × 11 inches.
    pub const LETTER: Self = Self::new(215.9, 279.4);

    /// Paper of another size, in millimeters.
    pub const fn new(width: f32, height: f32) -> Self {
        Self { width, height }
    }

    /// The same paper, wider than high.
    pub fn landscape(self) -> Self {
        Self::new(self.width.max(self.height), self.width.min(self.height))
    }

    pub(super) fn size(self) -> Vec2 {
        Vec2::new(self.width, self.height)
    }
}

/// A4, upright.
impl Default for PaperSize {
    fn default() -> Self {
        Self::A4
    }
}

/// `A5`, `A4`, `A3` or `Letter`, also with `-landscape` behind it, or millimeters as in `200x150`.
impl FromStr for PaperSize {
    type Err = TrackingError;

    fn from_str(text: &str) -> Result<Self, TrackingError> {
        let (name, is_landscape) = text.strip_suffix("-landscape").map_or((text, false), |name| (name, true));
        let custom = || {
            let (width, height) = name.split_once('x')?;
            let paper = Self::new(width.trim().parse().ok()?, height.trim().parse().ok()?);
            (paper.size().is_finite() && paper.size().min_element() > 0.0).then_some(paper)
        };
        let paper = match name.to_ascii_lowercase().as_str() {
            "a5" => Some(Self::A5),
            "a4" => Some(Self::A4),
            "a3" => Some(Self::A3),
            "letter" => Some(Self::LETTER),
            _ => custom(),
        };
        let paper = paper.ok_or_else(|| TrackingError::NoSuchPaper(text.to_owned()))?;
        Ok(if is_landscape { paper.landscape() } else { paper })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_millimeters_are_read() {
        assert_eq!("a3".parse(), Ok(PaperSize::A3));
        assert_eq!("Letter-landscape".parse(), Ok(PaperSize::new(279.4, 215.9)));
        for wrong in ["", "A6", "200", "0x5", "infx5", "axb", "landscape"] {
            assert_eq!(wrong.parse::<PaperSize>(), Err(TrackingError::NoSuchPaper(wrong.to_owned())));
        }
    }
}
