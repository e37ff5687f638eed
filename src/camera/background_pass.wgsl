// Draws the camera frame behind everything.

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput

/// Mirror of `BackgroundUniform` in background_pipeline.rs.
struct Background {
    /// frame_uv = view_uv * xy + zw
    frame_uv_from_view_uv: vec4f,
}

@group(0) @binding(0) var frame: texture_2d<f32>;
@group(0) @binding(1) var frame_sampler: sampler;
@group(0) @binding(2) var<uniform> background: Background;

@fragment
fn fragment(in: FullscreenVertexOutput) -> @location(0) vec4f {
    let map = background.frame_uv_from_view_uv;
    let uv_frame = in.uv * map.xy + map.zw;
    if any(uv_frame < vec2f(0.0)) || any(uv_frame > vec2f(1.0)) {
        discard;
    }
    return vec4f(textureSampleLevel(frame, frame_sampler, uv_frame, 0.0).rgb, 1.0);
}
