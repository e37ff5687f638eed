//! Luminance of linear sRGB: the shader library `luminance.wgsl` and its counterpart on the CPU.

use bevy::{prelude::*, shader::load_shader_library};

/// Weights of linear red, green and blue in luminance (ITU-R BT.709). Mirror of `LUMINANCE_WEIGHTS` in
/// `luminance.wgsl`.
const LUMINANCE_WEIGHTS: Vec3 = Vec3::new(0.2126, 0.7152, 0.0722);

/// Luminance of a linear color.
pub(crate) fn luminance(linear: Vec3) -> f32 {
    linear.dot(LUMINANCE_WEIGHTS)
}

/// Loads the shader library for the shaders of a plugin.
pub(crate) fn load(app: &mut App) {
    load_shader_library!(app, "luminance.wgsl");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shaders_weigh_colors_alike() {
        let text = include_str!("luminance.wgsl");
        let weights = LUMINANCE_WEIGHTS.to_array().map(|weight| weight.to_string()).join(", ");
        assert!(text.contains(&format!("vec3f({weights})")), "{weights}");
        assert!((luminance(Vec3::ONE) - 1.0).abs() < 1e-6);
    }
}
