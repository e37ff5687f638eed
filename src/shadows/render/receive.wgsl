// Fraction of light that arrives at a fragment, for materials: interpolated from the visibility pass where that has
// samples of the surface, summed over the dome elsewhere.
//
// Definitions: SAMPLES_ONLY: where the nearest samples show other surfaces, others near them stand in for a sum.

#define_import_path bevy_mirrorball::shadows::render::receive

#import bevy_pbr::mesh_view_bindings::view
#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::shadows::render::bindings::dome
#import bevy_mirrorball::shadows::render::samples::{
    PHANTOM_BITS, VIRTUAL_BITS, VisibilitySample, first_sample, kind_of, surface_similarity, unpack_normal,
}
#import bevy_mirrorball::shadows::render::maps::has_lamps
#import bevy_mirrorball::shadows::render::visibility::{
    luminance_fraction, phantom_visibility, real_visibility, virtual_visibility,
}
#ifdef DEPTH_PREPASS
#ifdef NORMAL_PREPASS
#ifdef MULTISAMPLED
#import bevy_pbr::mesh_view_bindings::depth_prepass_texture
#endif
#endif
#endif

/// Samples of the visibility pass, row by row.
@group(#{MATERIAL_BIND_GROUP}) @binding(104) var<storage, read> visibility_samples: array<VisibilitySample>;

/// Minimum total weight of the nearest samples.
const MIN_SAMPLE_WEIGHT: f32 = 0.05;
/// Minimum total weight without which there are no samples. With less, the fragment reads the shadow maps itself.
#ifdef SAMPLES_ONLY
const MIN_FOUND_WEIGHT: f32 = 0.0;
#else
const MIN_FOUND_WEIGHT: f32 = MIN_SAMPLE_WEIGHT;
#endif

#ifdef DEPTH_PREPASS
#ifdef NORMAL_PREPASS
/// Interpolated samples of the visibility pass.
struct SampleLookup {
    /// Weighted mean of the stored samples.
    fraction: vec4f,
    /// Total weight.
    weight: f32,
}

#ifdef SAMPLES_ONLY
/// The four nearest samples, then all within a square of four by four around them.
const LOOKED_AT: u32 = 20u;
#else
const LOOKED_AT: u32 = 4u;
#endif
/// Weights of samples of the same kind of surface, and of any, beside those of the same surface.
const SAME_KIND_WEIGHT: f32 = 1e-3;
const ANY_WEIGHT: f32 = 1e-6;

#ifdef MULTISAMPLED
/// Position within a pixel at which the prepass was sampled.
fn sample_position() -> vec2f {
    return first_sample(textureNumSamples(depth_prepass_texture));
}
#else
fn sample_position() -> vec2f {
    return first_sample(1u);
}
#endif

fn lookup_samples(frag_coord: vec4f, pos_world: vec3f, normal: vec3f, kind: u32) -> SampleLookup {
    let step = f32(dome.sample_pixels);
    let place = max((frag_coord.xy - sample_position()) / step, vec2f(0.0));
    let base = vec2i(place);
    let fraction = place - vec2f(base);
    let last = vec2i(dome.visibility_size) - 1;
    let distance_to_camera = distance(pos_world, view.world_position);
    var sum = vec4f(0.0);
    var weights = 0.0;
    for (var i = 0u; i < LOOKED_AT; i++) {
        if i == 4u && weights > MIN_SAMPLE_WEIGHT {
            break;
        }
        let is_nearest = i < 4u;
        let corner = select(vec2i(vec2u(i % 4u, (i - 4u) / 4u)) - 1, vec2i(vec2u(i % 2u, i / 2u)), is_nearest);
        let at = vec2u(clamp(base + corner, vec2i(0), last));
        let sample = visibility_samples[at.y * dome.visibility_size.x + at.x];
        let stored = vec4f(unpack2x16float(sample.fraction.x), unpack2x16float(sample.fraction.y));
        let offset = sample.pos_world - pos_world;
        let same = surface_similarity(offset, normal, unpack_normal(sample.facing), distance_to_camera);
        let is_same_kind = kind_of(sample.facing) == kind;
        let aside = vec2f(corner) - fraction;
        let bilinear = max(1.0 - abs(aside), vec2f(0.0));
        var weight = select(0.0, bilinear.x * bilinear.y * same, is_same_kind);
        if !is_nearest {
            let unlike = select(ANY_WEIGHT, SAME_KIND_WEIGHT, is_same_kind);
            weight = (unlike + select(0.0, same, is_same_kind)) / (1.0 + dot(aside, aside));
        }
        weight = select(0.0, weight, stored.a > 0.0);
        sum += stored * weight;
        weights += weight;
    }
    return SampleLookup(sum / max(weights, 1e-20), weights);
}

/// Whether the visibility samples belong to this camera and have its current size.
fn has_visibility_samples() -> bool {
    let difference = abs(dome.visibility_clip_from_world[0] - view.unjittered_clip_from_world[0])
        + abs(dome.visibility_clip_from_world[1] - view.unjittered_clip_from_world[1])
        + abs(dome.visibility_clip_from_world[2] - view.unjittered_clip_from_world[2])
        + abs(dome.visibility_clip_from_world[3] - view.unjittered_clip_from_world[3]);
    let is_same_viewport = all(dome.visibility_viewport == view.viewport);
    let is_whole = arrayLength(&visibility_samples) == dome.visibility_size.x * dome.visibility_size.y;
    return dome.sample_pixels > 0u && is_whole && is_same_viewport && dot(difference, vec4f(1.0)) < 1e-4;
}
#endif
#endif

/// Factor on the camera's frame at a phantom. Alpha: luminance of the real light that other phantoms leave, as a
/// fraction of that of the open sky; computed only if there are lamps, whose light is compared with it.
fn phantom_ratio(frag_coord: vec4f, pos_world: vec3f, normal: vec3f) -> vec4f {
#ifdef DEPTH_PREPASS
#ifdef NORMAL_PREPASS
    if has_visibility_samples() {
        let found = lookup_samples(frag_coord, pos_world, normal, PHANTOM_BITS);
        if found.weight > MIN_FOUND_WEIGHT {
            return found.fraction;
        }
    }
#endif
#endif
#ifdef SAMPLES_ONLY
    return vec4f(1.0);
#else
    var left = 1.0;
    if has_lamps() {
        left = luminance_fraction(real_visibility(pos_world, normal));
    }
    return vec4f(phantom_visibility(pos_world, normal), left);
#endif
}

/// Factor on the diffuse image-based light of a virtual surface.
fn virtual_ratio(frag_coord: vec4f, pos_world: vec3f, normal: vec3f) -> vec3f {
#ifdef DEPTH_PREPASS
#ifdef NORMAL_PREPASS
    if has_visibility_samples() {
        let found = lookup_samples(frag_coord, pos_world, normal, VIRTUAL_BITS);
        if found.weight > MIN_FOUND_WEIGHT {
            return found.fraction.rgb;
        }
    }
#endif
#endif
#ifdef SAMPLES_ONLY
    return vec3f(1.0);
#else
    return virtual_visibility(pos_world, normal);
#endif
}

/// Factor on the image-based reflections of a virtual surface; 1 unless the dome occludes reflections. It is derived
/// from the fraction of diffuse light and the roughness (Lagarde and de Rousiers 2014, *Moving Frostbite to
/// Physically Based Rendering*, §4.10.2).
fn reflection_ratio(ratio: vec3f, cos_view: f32, perceptual_roughness: f32) -> f32 {
    let fraction = saturate(luminance(ratio));
    let roughness = perceptual_roughness * perceptual_roughness;
    let left = saturate(pow(max(cos_view, 0.0) + fraction, exp2(-16.0 * roughness - 1.0)) - 1.0 + fraction);
    return mix(1.0, left, f32(dome.occludes_reflections));
}
