// Camera frame coordinates of the fragments of a phantom.

#define_import_path bevy_mirrorball::materials::phantom_frame

#import bevy_pbr::mesh_view_bindings::view

/// Mirror of `PhantomUniform` in `phantom.rs`.
struct Phantom {
    /// uv_frame = uv_view * xy + zw
    frame_uv_from_view_uv: vec4f,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(2) var<uniform> phantom: Phantom;

/// UV in the frame of a fragment at a position in the viewport of the main pass, in pixels.
fn frame_uv(position: vec4f) -> vec2f {
    let uv_view = (position.xy - view.main_pass_viewport.xy) / view.main_pass_viewport.zw;
    return uv_view * phantom.frame_uv_from_view_uv.xy + phantom.frame_uv_from_view_uv.zw;
}

/// Whether a UV is outside the frame, where phantoms are not drawn.
fn is_outside_frame(uv_frame: vec2f) -> bool {
    return any(uv_frame < vec2f(0.0)) || any(uv_frame > vec2f(1.0));
}
