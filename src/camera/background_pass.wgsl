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

fn frame_uv(uv_view: vec2f) -> vec2f {
    return uv_view * background.frame_uv_from_view_uv.xy + background.frame_uv_from_view_uv.zw;
}

fn is_outside(uv_frame: vec2f) -> bool {
    return any(uv_frame < vec2f(0.0)) || any(uv_frame > vec2f(1.0));
}

#ifdef MARKS_REAL
/// The blend of `BackgroundPipeline` multiplies what is in the target with this alpha, and clears the target's alpha.
@fragment
fn fragment(in: FullscreenVertexOutput) -> @location(0) vec4f {
    let uv_frame = frame_uv(in.uv);
    let color = textureSampleLevel(frame, frame_sampler, uv_frame, 0.0).rgb;
    return select(vec4f(color, 0.0), vec4f(vec3f(0.0), 1.0), is_outside(uv_frame));
}
#else
@fragment
fn fragment(in: FullscreenVertexOutput) -> @location(0) vec4f {
    let uv_frame = frame_uv(in.uv);
    if is_outside(uv_frame) {
        discard;
    }
    return vec4f(textureSampleLevel(frame, frame_sampler, uv_frame, 0.0).rgb, 1.0);
}
#endif
