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
    RankSubset, luminance_fraction, phantom_visibility, real_visibility, virtual_visibility,
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

/// Interpolated samples of the visibility pass.
struct SampleLookup {
    /// Weighted mean of the stored samples.
    fraction: vec4f,
    /// Total weight.
    weight: f32,
}

/// Place of a surface in the picture of the camera with a visibility pass.
struct SampledPlace {
    /// Pixels from the first sample.
    place: vec2f,
    /// Distance to that camera in meters; 0 if it has no samples there, or too coarse ones.
    distance: f32,
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
/// Largest distance between samples, in pixels of another camera, for which that takes them. The faces of cubes take
/// them in any case: curved mirrors show a face much smaller than it is.
const MAX_SAMPLE_STEP: f32 = 2.0;
/// Smallest depth of a point in front of a camera, in meters.
const MIN_CLIP_DEPTH: f32 = 1e-6;

fn lookup_samples(at: SampledPlace, pos_world: vec3f, normal: vec3f, kind: u32) -> SampleLookup {
    let step = f32(dome.sample_pixels);
    let place = max(at.place / step, vec2f(0.0));
    let base = vec2i(place);
    let fraction = place - vec2f(base);
    let last = vec2i(dome.visibility_size) - 1;
    var sum = vec4f(0.0);
    var weights = 0.0;
    for (var i = 0u; i < LOOKED_AT; i++) {
        if i == 4u && weights > MIN_SAMPLE_WEIGHT {
            break;
        }
        let is_nearest = i < 4u;
        let corner = select(vec2i(vec2u(i % 4u, (i - 4u) / 4u)) - 1, vec2i(vec2u(i % 2u, i / 2u)), is_nearest);
        let index = vec2u(clamp(base + corner, vec2i(0), last));
        let sample = visibility_samples[index.y * dome.visibility_size.x + index.x];
        let stored = vec4f(unpack2x16float(sample.fraction.x), unpack2x16float(sample.fraction.y));
        let offset = sample.pos_world - pos_world;
        let same = surface_similarity(offset, normal, unpack_normal(sample.facing), at.distance);
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

/// Whether this camera renders a face of a cube.
fn is_cube_face() -> bool {
    let widening = abs(vec2f(view.clip_from_view[0].x, view.clip_from_view[1].y));
    return all(abs(widening - 1.0) < vec2f(1e-5));
}

/// Whether there are visibility samples, of whatever camera, in their current number.
fn has_samples() -> bool {
    let is_whole = arrayLength(&visibility_samples) == dome.visibility_size.x * dome.visibility_size.y;
    return dome.sample_pixels > 0u && is_whole;
}

/// Meters per pixel at a depth of one meter, for a camera's matrix and the height of its viewport.
fn pixel_size(clip_from_world: mat4x4f, height: f32) -> f32 {
    let up = vec3f(clip_from_world[0].y, clip_from_world[1].y, clip_from_world[2].y);
    return 2.0 / (length(up) * height);
}

/// Place of a surface among the samples of another camera.
fn projected_place(pos_world: vec3f) -> SampledPlace {
    let there = dome.visibility_clip_from_world * vec4f(pos_world, 1.0);
    let here = view.clip_from_world * vec4f(pos_world, 1.0);
    let depth = max(there.w, MIN_CLIP_DEPTH);
    let ndc = there.xy / depth;
    let pixel = depth * pixel_size(dome.visibility_clip_from_world, dome.visibility_viewport.w);
    let step = f32(dome.sample_pixels) * pixel;
    let is_fine = step <= MAX_SAMPLE_STEP * here.w * pixel_size(view.clip_from_world, view.viewport.w);
    let is_seen = there.w > MIN_CLIP_DEPTH && all(abs(ndc) < vec2f(1.0)) && (is_fine || is_cube_face());
    let place = dome.visibility_viewport.xy + (ndc * vec2f(0.5, -0.5) + 0.5) * dome.visibility_viewport.zw;
    return SampledPlace(place - 0.5, select(0.0, depth, is_seen));
}

#ifdef DEPTH_PREPASS
#ifdef NORMAL_PREPASS
/// Whether the visibility samples belong to this camera.
fn are_own_samples() -> bool {
    let difference = abs(dome.visibility_clip_from_world[0] - view.unjittered_clip_from_world[0])
        + abs(dome.visibility_clip_from_world[1] - view.unjittered_clip_from_world[1])
        + abs(dome.visibility_clip_from_world[2] - view.unjittered_clip_from_world[2])
        + abs(dome.visibility_clip_from_world[3] - view.unjittered_clip_from_world[3]);
    return all(dome.visibility_viewport == view.viewport) && dot(difference, vec4f(1.0)) < 1e-4;
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

/// Place of a fragment among the samples, if they are its camera's own. Those of another camera are not looked for:
/// software rasterizers would do it for all fragments.
fn sampled_place(frag_coord: vec4f, pos_world: vec3f) -> SampledPlace {
    let distance_to_camera = distance(pos_world, view.world_position);
    return SampledPlace(frag_coord.xy - sample_position(), select(0.0, distance_to_camera, are_own_samples()));
}
#else
fn sampled_place(frag_coord: vec4f, pos_world: vec3f) -> SampledPlace {
    return projected_place(pos_world);
}
#endif
#else
fn sampled_place(frag_coord: vec4f, pos_world: vec3f) -> SampledPlace {
    return projected_place(pos_world);
}
#endif

/// Directions and surfels that a fragment without samples sums over: all, but in each of 2 × 2 pixels of the face of a
/// cube a quarter of them. Most of what a face shows has samples, and reflections blur the rest.
fn ranks_of(frag_coord: vec4f) -> RankSubset {
    let pixel = vec2u(frag_coord.xy) % 2u;
    return RankSubset(select(0u, pixel.x + 2u * pixel.y, is_cube_face()), select(1u, 4u, is_cube_face()));
}

/// Factor on the camera's frame at a phantom. Alpha: luminance of the real light that other phantoms leave, as a
/// fraction of that of the open sky; computed only if there are lamps, whose light is compared with it.
fn phantom_ratio(frag_coord: vec4f, pos_world: vec3f, normal: vec3f) -> vec4f {
    let at = sampled_place(frag_coord, pos_world);
    if has_samples() && at.distance > 0.0 {
        let found = lookup_samples(at, pos_world, normal, PHANTOM_BITS);
        if found.weight > MIN_FOUND_WEIGHT {
            return found.fraction;
        }
    }
#ifdef SAMPLES_ONLY
    return vec4f(1.0);
#else
    let ranks = ranks_of(frag_coord);
    var left = 1.0;
    if has_lamps() {
        left = luminance_fraction(real_visibility(pos_world, normal, ranks));
    }
    return vec4f(phantom_visibility(pos_world, normal, ranks), left);
#endif
}

/// Factor on the diffuse image-based light of a virtual surface.
fn virtual_ratio(frag_coord: vec4f, pos_world: vec3f, normal: vec3f) -> vec3f {
    let at = sampled_place(frag_coord, pos_world);
    if has_samples() && at.distance > 0.0 {
        let found = lookup_samples(at, pos_world, normal, VIRTUAL_BITS);
        if found.weight > MIN_FOUND_WEIGHT {
            return found.fraction.rgb;
        }
    }
#ifdef SAMPLES_ONLY
    return vec3f(1.0);
#else
    return virtual_visibility(pos_world, normal, ranks_of(frag_coord));
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
