// Camera frame coordinates of the fragments of a phantom.

#define_import_path bevy_mirrorball::materials::phantom_frame

#import bevy_pbr::mesh_view_bindings::view

/// Mirror of `PhantomUniform` in `phantom.rs`.
struct Phantom {
    /// By place in the view: uv_frame = uv_view * xy + zw
    frame_uv_from_view_uv: vec4f,
    /// By place in the world, homogeneous. Added to the former: one of them contributes nothing, so that nothing has to
    /// branch on a uniform.
    frame_uv_from_world: mat4x4f,
    /// Place in the world from which the environment shows what the frame does not; w: 1, or 0 without one, where
    /// phantoms then do not exist.
    captured_from: vec4f,
    /// Place of the camera that projects its frame; w: 1 if `captured_from` shows what faces away from it, else 0.
    projected_from: vec4f,
    /// Boxes −1…1 from world, of real things that hide others from that camera; zeros for none.
    occluders: array<mat4x4f, 8>,
    /// Motion vector of the frame.
    motion: vec2f,
    /// Alpha with which phantoms are drawn: 0 where it tells real from virtual, else 1.
    alpha: f32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(2) var<uniform> phantom: Phantom;

/// Smallest depth of a point in front of the camera that projects the frame, in meters.
const MIN_DEPTH: f32 = 1e-6;
/// A place outside the frame.
const NOWHERE: vec2f = vec2f(-1.0);

/// UV in the frame of a fragment at a position in the viewport of the main pass, in pixels, and in the world.
fn frame_uv(position: vec4f, pos_world: vec4f) -> vec2f {
    let uv_view = (position.xy - view.main_pass_viewport.xy) / view.main_pass_viewport.zw;
    let projected = phantom.frame_uv_from_world * vec4f(pos_world.xyz, 1.0);
    let uv_frame = projected.xy / max(projected.w, MIN_DEPTH)
        + uv_view * phantom.frame_uv_from_view_uv.xy + phantom.frame_uv_from_view_uv.zw;
    return select(NOWHERE, uv_frame, projected.w > MIN_DEPTH);
}

/// Whether a UV is outside the frame, where phantoms are not drawn unless the environment shows them.
fn is_outside_frame(uv_frame: vec2f) -> bool {
    return any(uv_frame < vec2f(0.0)) || any(uv_frame > vec2f(1.0));
}

/// Whether a fragment is not drawn: the frame does not show it, and neither does an environment. Compares instead of
/// branching on a uniform.
fn is_unknown(uv_frame: vec2f) -> bool {
    return select(0.0, 1.0, is_outside_frame(uv_frame)) > phantom.captured_from.w;
}

/// Whether the environment shows a fragment rather than the frame: outside of the frame, where the surface faces away
/// from the camera that projects it, and where another real thing is in front.
fn is_beyond_frame(uv_frame: vec2f, pos_world: vec3f, normal: vec3f) -> bool {
    let towards = phantom.projected_from.xyz - pos_world;
    let faces_away = dot(normal, towards) * phantom.projected_from.w < 0.0;
    return is_outside_frame(uv_frame) || faces_away || is_hidden(pos_world, towards);
}

/// Whether a box lies between a place outside of it and the camera that projects the frame. Places within the box of a
/// thing belong to it.
fn is_hidden(pos_world: vec3f, towards: vec3f) -> bool {
    var is_hidden = false;
    for (var i = 0u; i < 8u; i++) {
        let start = (phantom.occluders[i] * vec4f(pos_world, 1.0)).xyz;
        let along = (phantom.occluders[i] * vec4f(towards, 0.0)).xyz;
        let sign = select(vec3f(1.0), vec3f(-1.0), along < vec3f(0.0));
        let rate = 1.0 / max(abs(along), vec3f(1e-6));
        let entered = (-1.0 - start * sign) * rate;
        let left = (1.0 - start * sign) * rate;
        let first = max(max(entered.x, entered.y), entered.z);
        let last = min(min(left.x, left.y), left.z);
        is_hidden = is_hidden || (first > 1e-3 && first < min(last, 1.0));
    }
    return is_hidden;
}
