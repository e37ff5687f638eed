//! Image sizes on the command line.

use bevy::math::UVec2;

/// Parses `WIDTHxHEIGHT`; `None` if that is not two positive whole numbers.
pub(crate) fn parse_size(text: &str) -> Option<UVec2> {
    let (width, height) = text.split_once('x')?;
    Some(UVec2::new(width.parse().ok()?, height.parse().ok()?)).filter(|size| size.min_element() > 0)
}
