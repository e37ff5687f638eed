// Motion vectors of pixels that show the camera frame. The frame has moved and blurred in the real camera already, so
// effects must take it as it is.

#define_import_path bevy_mirrorball::camera::real_motion

/// Motion in UV that points out of the view, where temporal antialiasing has no history: it then shows the new frame
/// alone. With a history it would lower the contrast of frames at rest and drag those in motion.
const WITHOUT_HISTORY: vec2f = vec2f(8.0, 8.0);
/// Smallest difference between the jittered and the plain projection that is no rounding.
const MIN_JITTER: f32 = 4e-6;

/// Motion vector of the frame in a view with these projections: zero for motion blur, and none with temporal
/// antialiasing, which is known by its jitter.
fn motion_of_frame(clip_from_world: mat4x4f, unjittered_clip_from_world: mat4x4f) -> vec2f {
    let difference = abs(clip_from_world[0] - unjittered_clip_from_world[0])
        + abs(clip_from_world[1] - unjittered_clip_from_world[1])
        + abs(clip_from_world[2] - unjittered_clip_from_world[2]);
    return select(vec2f(0.0), WITHOUT_HISTORY, dot(difference, vec4f(1.0)) > MIN_JITTER);
}
