// Samples of a prepass and of the visibility pass: which kind of surface they show, where it is, and whether two
// samples show the same surface.

#define_import_path bevy_mirrorball::shadows::render::samples

/// Alpha of normals in the prepass: a phantom that receives shadows, a phantom that only hides, a virtual surface.
const IS_PHANTOM: f32 = 0.0;
const IS_HIDING: f32 = 0.33333;
const IS_VIRTUAL: f32 = 1.0;
/// The same as bits of a facing, and what neither kind of surface has.
const PHANTOM_BITS: u32 = 0u;
const VIRTUAL_BITS: u32 = 3u;
const NO_SURFACE: u32 = 0x80000000u;

/// A sample of the visibility pass. Twin of `VISIBILITY_BYTES` in `atlas.rs`.
struct VisibilitySample {
    pos_world: vec3f,
    /// Texel of the prepass's normals: ten bits per component, then two for the kind of surface.
    facing: u32,
    /// Fraction of light that arrives, as four 16-bit floats; all 0 if it was never computed.
    fraction: vec2u,
    /// Depth in the prepass.
    depth: f32,
    unused: f32,
}

fn pack_facing(facing: vec4f, depth: f32) -> u32 {
    let bits = vec4u(round(facing * vec4f(1023.0, 1023.0, 1023.0, 3.0)));
    return select(NO_SURFACE, bits.x | (bits.y << 10u) | (bits.z << 20u) | (bits.w << 30u), depth > 0.0);
}

fn unpack_normal(facing: u32) -> vec3f {
    return normalize(vec3f((vec3u(facing) >> vec3u(0u, 10u, 20u)) & vec3u(1023u)) / 511.5 - 1.0);
}

fn kind_of(facing: u32) -> u32 {
    return facing >> 30u;
}

/// Maximum sine of the angle between a sample and the tangent plane, for a sample of the same surface.
const MAX_PLANE_SINE: f32 = 0.3;
/// Distance from the tangent plane at which a sample counts in any case, as a fraction of the distance to the camera.
const MIN_PLANE_STEP: f32 = 1e-3;
/// Cosines between the normals: below the first a sample does not count, from the second on it counts fully.
const NORMAL_COSINES: vec2f = vec2f(0.8, 0.95);

/// Degree to which a sample at an offset from a position on a surface belongs to that surface, 0…1.
fn surface_similarity(offset: vec3f, normal: vec3f, other_normal: vec3f, distance_to_camera: f32) -> f32 {
    let is_near = abs(dot(offset, normal)) <= MAX_PLANE_SINE * length(offset) + MIN_PLANE_STEP * distance_to_camera;
    return select(0.0, smoothstep(NORMAL_COSINES.x, NORMAL_COSINES.y, dot(other_normal, normal)), is_near);
}

/// Minimum depth. Smaller ones are raised to it, because infinitely far pixels have no world-space position.
const MIN_DEPTH: f32 = 1e-9;

/// Position of a pixel's first sample, from the top-left corner: the center without multisampling, otherwise the
/// standard position of Vulkan, Direct3D and Metal (Vulkan 1.3, 25.4 "Multisampling"). `MIRRORED_SAMPLES` is for
/// drivers that mirror the standard positions from left to right (`mirrors_samples` in device.rs); these support no
/// other count than 4.
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

/// World-space position of a position on screen, in pixels, at a depth.
fn world_position(world_from_clip: mat4x4f, viewport: vec4f, place: vec2f, depth: f32) -> vec3f {
    let uv = (place - viewport.xy) / viewport.zw;
    let pos = world_from_clip * vec4f(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, max(depth, MIN_DEPTH), 1.0);
    return pos.xyz / pos.w;
}
