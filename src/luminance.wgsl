#define_import_path bevy_mirrorball::luminance

/// Weights of linear red, green and blue in luminance (ITU-R BT.709). Mirror of `LUMINANCE_WEIGHTS` in `luminance.rs`.
const LUMINANCE_WEIGHTS = vec3f(0.2126, 0.7152, 0.0722);

/// Luminance of a linear color. Twin of `luminance` in `luminance.rs`.
fn luminance(linear: vec3f) -> f32 {
    return dot(linear, LUMINANCE_WEIGHTS);
}
