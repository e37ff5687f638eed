//! Recovery of clipped light from what stands on the desk, and detection of lights in it. Needs no GPU.

#[cfg(feature = "apriltag")]
mod desk_app;
#[cfg(feature = "apriltag")]
mod evidence;
mod faces;
mod known_rooms;
#[cfg(feature = "apriltag")]
mod moving_lamp;
mod sun_in_clouds;
mod traced;

use bevy_mirrorball::camera::FramePixels;

/// Maximum relative error of irradiance at tilted surfaces.
const TILTED_TOLERANCE: f32 = 0.18;
/// Maximum error of the direction of a light, in degrees.
const KEY_LIGHT_DEGREES: f32 = 3.0;
/// Standard deviation of the noise of a camera, in steps of 8-bit sRGB.
const NOISE: f32 = 1.5;
/// Maximum variation of the energy of a light, standard deviation ÷ mean.
const ENERGY_VARIATION: f32 = 0.05;
/// Maximum RMSE of a virtual ball over the real one, sRGB-encoded.
#[cfg(feature = "apriltag")]
const SELF_CHECK: f32 = 0.1;

/// The picture with other noise: sums of four uniform numbers (xorshift).
fn noisy(frame: &FramePixels, seed: u64) -> FramePixels {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64.wrapping_mul(seed + 1);
    let mut uniform = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / (1 << 24) as f32 - 0.5
    };
    let rgba = frame.rgba.iter().map(|&byte| {
        let noise = (uniform() + uniform() + uniform() + uniform()) * 3_f32.sqrt() * NOISE;
        (f32::from(byte) + noise).round().clamp(0.0, 255.0) as u8
    });
    FramePixels::new(frame.size, rgba.collect()).expect("the same size")
}

/// Standard deviation ÷ mean.
fn variation(values: &[f32]) -> f32 {
    let mean = values.iter().sum::<f32>() / values.len() as f32;
    let variance = values.iter().map(|e| (e - mean).powi(2)).sum::<f32>() / values.len() as f32;
    variance.sqrt() / mean
}
