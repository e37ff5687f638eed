// Observation: what one frame shows in the direction of one texel of the environment cube.

#define_import_path bevy_mirrorball::unwrap::observation

#import bevy_mirrorball::environment_map::cubemap::face_direction

/// Confidence of a guess.
const MIN_CONFIDENCE: f32 = 0.001;

/// Observation of one direction.
struct Observation {
    /// Radiance, or the best guess of it from this frame alone, in camera units.
    radiance: vec3f,
    /// Pixels per texel along an edge, at most 1.
    resolution: f32,
    /// Visibility of the direction in the frame, 0…1.
    visibility: f32,
    /// Quality of `radiance` as a guess where the direction is not visible, 0…1; at 1 it replaces an old measurement.
    guess_quality: f32,
}

/// World direction of a position on a cube face, −1…1. The frame of a cube has the negative z of the world.
fn world_direction(face: u32, p: vec2f) -> vec3f {
    return face_direction(face, p) * vec3f(1.0, 1.0, -1.0);
}
