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
    /// Motion vector of the frame.
    motion: vec2f,
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

/// Whether a UV is outside the frame, where phantoms are not drawn.
fn is_outside_frame(uv_frame: vec2f) -> bool {
    return any(uv_frame < vec2f(0.0)) || any(uv_frame > vec2f(1.0));
}
