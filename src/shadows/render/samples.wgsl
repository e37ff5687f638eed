// What the prepass says of a picture's samples, and when two of them are of the same surface.

#define_import_path bevy_mirrorball::shadows::render::samples

/// Alpha of normals in the prepass: a phantom that receives, one that only hides, a virtual surface.
const IS_PHANTOM: f32 = 0.0;
const IS_HIDING: f32 = 0.33333;
const IS_VIRTUAL: f32 = 1.0;
/// A sample belongs to the same surface if it lies no steeper than this (sine) above or below the tangent plane…
const MAX_PLANE_SINE: f32 = 0.3;
/// …within this share of the distance to the camera in any case…
const MIN_PLANE_STEP: f32 = 1e-3;
/// …and if the cosine between the normals is above the second of these; below the first it does not count at all.
const NORMAL_COSINES: vec2f = vec2f(0.8, 0.95);

/// Whether a sample that is an offset away from a place on a surface is of that surface, 0…1.
fn surface_similarity(offset: vec3f, normal: vec3f, other_normal: vec3f, distance_to_camera: f32) -> f32 {
    let is_near = abs(dot(offset, normal)) <= MAX_PLANE_SINE * length(offset) + MIN_PLANE_STEP * distance_to_camera;
    return select(0.0, smoothstep(NORMAL_COSINES.x, NORMAL_COSINES.y, dot(other_normal, normal)), is_near);
}

/// Depths below this count as this much: what is infinitely far has no place in the world.
const MIN_DEPTH: f32 = 1e-9;

/// Place of a pixel's first sample, from the top-left corner: the middle without multisampling, else where Vulkan, Direct3D
/// and Metal put it by standard (Vulkan 1.3, 25.4 "Multisampling"). `MIRRORED_SAMPLES` is for drivers that mirror the standard
/// places from left to right (`mirrors_samples` in device.rs); they have no other counts than 4.
fn first_sample(samples: u32) -> vec2f {
    switch samples {
        case 2u: { return vec2f(0.75, 0.75); }
#ifdef MIRRORED_SAMPLES
        case 4u: { return vec2f(0.625, 0.125); }
#else
        case 4u: { return vec2f(0.375, 0.125); }
#endif
        case 8u: { return vec2f(0.5625, 0.3125); }
        case 16u: { return vec2f(0.5625, 0.5625); }
        default: { return vec2f(0.5, 0.5); }
    }
}

/// Where in the world a place in the picture, in pixels, is at a depth.
fn world_position(world_from_clip: mat4x4f, viewport: vec4f, place: vec2f, depth: f32) -> vec3f {
    let uv = (place - viewport.xy) / viewport.zw;
    let pos = world_from_clip * vec4f(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, max(depth, MIN_DEPTH), 1.0);
    return pos.xyz / pos.w;
}
