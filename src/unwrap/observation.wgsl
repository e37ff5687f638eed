// What one frame shows of one texel of the environment cube.

#define_import_path bevy_mirrorball::unwrap::observation

#import bevy_mirrorball::environment_map::cubemap::face_direction

/// Confidence of what is only guessed.
const MIN_CONFIDENCE: f32 = 0.001;

/// What a picture says about a direction.
struct Seen {
    /// The best guess from this picture alone.
    radiance: vec3f,
    /// Pixels per texel, per side, at most 1.
    resolution: f32,
    /// Whether the picture shows the direction at all, 0…1.
    shown: f32,
    /// Whether `radiance` is better than an old measurement though the direction is not shown, 0…1.
    guessed: f32,
}

/// World direction of a position (-1…1) on a cube face. Lookups negate z, so the faces are stored mirrored in z.
fn world_direction(face: u32, p: vec2f) -> vec3f {
    return face_direction(face, p) * vec3f(1.0, 1.0, -1.0);
}
