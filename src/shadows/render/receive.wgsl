// Fraction of light that arrives at a fragment, for materials: interpolated from the visibility pass where that has
// samples of the surface, summed over the dome elsewhere.

#define_import_path bevy_mirrorball::shadows::render::receive

#import bevy_pbr::mesh_view_bindings::view
#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::shadows::render::bindings::dome
#import bevy_mirrorball::shadows::render::samples::{
    IS_PHANTOM, IS_VIRTUAL, first_sample, surface_similarity, world_position,
}
#import bevy_mirrorball::shadows::render::visibility::{
    has_lamps, luminance_fraction, phantom_visibility, real_visibility, virtual_visibility,
}
#ifdef DEPTH_PREPASS
#ifdef NORMAL_PREPASS
#import bevy_pbr::mesh_view_bindings::{depth_prepass_texture, normal_prepass_texture}
#endif
#endif

/// Samples of the visibility pass, row by row: four 16-bit floats each.
@group(#{MATERIAL_BIND_GROUP}) @binding(104) var<storage, read> visibility_samples: array<vec2u>;

/// Minimum total weight of the samples. With less, the fragment reads the shadow maps itself.
const MIN_SAMPLE_WEIGHT: f32 = 0.05;

#ifdef DEPTH_PREPASS
#ifdef NORMAL_PREPASS
/// Interpolated samples of the visibility pass.
struct SampleLookup {
    /// Weighted mean of the stored samples.
    fraction: vec4f,
    /// Total weight.
    weight: f32,
}

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

fn lookup_samples(frag_coord: vec4f, pos_world: vec3f, normal: vec3f, kind: f32) -> SampleLookup {
    let step = f32(dome.sample_pixels);
    let place = max((frag_coord.xy - sample_position()) / step, vec2f(0.0));
    let base = floor(place);
    let fraction = place - base;
    let last = vec2f(dome.visibility_size) - 1.0;
    let distance_to_camera = distance(pos_world, view.world_position);
    var sum = vec4f(0.0);
    var weights = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let corner = vec2f(vec2u(i % 2u, i / 2u));
        let sample = min(base + corner, last);
        let pixel = vec2i(sample * step);
        let bilinear = mix(1.0 - fraction, fraction, corner);
        let packed = visibility_samples[u32(sample.y) * dome.visibility_size.x + u32(sample.x)];
        let stored = vec4f(unpack2x16float(packed.x), unpack2x16float(packed.y));
        let depth = textureLoad(depth_prepass_texture, pixel, 0);
        let facing = textureLoad(normal_prepass_texture, pixel, 0);
        let place_on_screen = vec2f(pixel) + sample_position();
        let offset = world_position(view.world_from_clip, view.main_pass_viewport, place_on_screen, depth) - pos_world;
        let is_same = depth > 0.0 && abs(facing.a - kind) < 0.1;
        let same = surface_similarity(offset, normal, normalize(facing.xyz * 2.0 - 1.0), distance_to_camera);
        let weight = select(0.0, bilinear.x * bilinear.y * same, is_same && stored.a > 0.0);
        sum += stored * weight;
        weights += weight;
    }
    return SampleLookup(sum / max(weights, 1e-6), weights);
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
        let found = lookup_samples(frag_coord, pos_world, normal, IS_PHANTOM);
        if found.weight > MIN_SAMPLE_WEIGHT {
            return found.fraction;
        }
    }
#endif
#endif
    var left = 1.0;
    if has_lamps() {
        left = luminance_fraction(real_visibility(pos_world, normal));
    }
    return vec4f(phantom_visibility(pos_world, normal), left);
}

/// Factor on the diffuse image-based light of a virtual surface.
fn virtual_ratio(frag_coord: vec4f, pos_world: vec3f, normal: vec3f) -> vec3f {
#ifdef DEPTH_PREPASS
#ifdef NORMAL_PREPASS
    if has_visibility_samples() {
        let found = lookup_samples(frag_coord, pos_world, normal, IS_VIRTUAL);
        if found.weight > MIN_SAMPLE_WEIGHT {
            return found.fraction.rgb;
        }
    }
#endif
#endif
    return virtual_visibility(pos_world, normal);
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
