// When two samples of a picture are of the same surface.

#define_import_path bevy_mirrorball::shadows::samples

/// Alpha of normals in the prepass: a phantom that receives, a virtual surface.
const IS_PHANTOM: f32 = 0.0;
const IS_VIRTUAL: f32 = 1.0;
/// A sample belongs to the same surface if it lies no steeper than this (sine) above or below the tangent plane…
const STEEPEST: f32 = 0.3;
/// …within this share of the distance to the camera in any case…
const LEAST_STEP: f32 = 1e-3;
/// …and if the cosine between the normals is above the second of these; below the first it does not count at all.
const SAME_NORMAL: vec2f = vec2f(0.8, 0.95);

/// Whether a sample that is an offset away from a place on a surface is of that surface, 0…1.
fn alike(offset: vec3f, normal: vec3f, other_normal: vec3f, distance_to_camera: f32) -> f32 {
    let is_near = abs(dot(offset, normal)) <= STEEPEST * length(offset) + LEAST_STEP * distance_to_camera;
    return select(0.0, smoothstep(SAME_NORMAL.x, SAME_NORMAL.y, dot(other_normal, normal)), is_near);
}
