// Fraction of light that arrives at the surface of the prepass, one thread per sample.
//
// Interleaved samples take two dispatches. In the first, `accumulate` (TALLY), each of 2 × 2 samples sums over a
// quarter of the directions. In the second, `gather` (GATHER), each sample takes the sums over the other directions
// from its neighbors (after Keller and Heidrich 2001, *Interleaved sampling*). Key lights have shadows with edges, so
// every sample reads all of them.

#import bevy_render::view::View
#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::shadows::render::bindings::dome
#import bevy_mirrorball::shadows::render::samples::{
    IS_PHANTOM, IS_VIRTUAL, first_sample, surface_similarity, world_position,
}
#import bevy_mirrorball::shadows::render::visibility::{
    LightSums, RankSubset, accumulate_phantom, accumulate_phantom_keys, accumulate_surface, accumulate_surface_keys,
    add_sums, has_lamps, luminance_fraction, phantom_factor, phantom_visibility, real_visibility,
    surface_factor, virtual_visibility,
}

@group(0) @binding(0) var<uniform> view: View;
#ifdef MULTISAMPLED
@group(0) @binding(1) var depths: texture_depth_multisampled_2d;
@group(0) @binding(2) var normals: texture_multisampled_2d<f32>;
#else
@group(0) @binding(1) var depths: texture_depth_2d;
@group(0) @binding(2) var normals: texture_2d<f32>;
#endif
#ifdef TALLY
@group(0) @binding(3) var partial_sums: texture_storage_2d<rgba32uint, write>;
#else
@group(0) @binding(3) var<storage, read_write> visibility_samples: array<vec2u>;
#endif
#ifdef GATHER
@group(0) @binding(4) var partial_sums: texture_2d<u32>;
#endif

#ifndef TALLY
fn store(sample: vec2u, fraction: vec4f) {
    let at = sample.y * dome.visibility_size.x + sample.x;
    visibility_samples[at] = vec2u(pack2x16float(fraction.rg), pack2x16float(fraction.ba));
}
#endif

/// Edge in samples of a square in which each direction is read once.
const SQUARE_EDGE: u32 = 2u;

#ifdef MULTISAMPLED
/// Position within a pixel at which the prepass was sampled.
fn sample_position() -> vec2f {
    return first_sample(textureNumSamples(depths));
}
#else
fn sample_position() -> vec2f {
    return first_sample(1u);
}
#endif

/// Surface at a sample of the prepass.
struct Surface {
    pos_world: vec3f,
    normal: vec3f,
    is_phantom: bool,
    is_virtual: bool,
}

fn surface_at(sample: vec2u) -> Surface {
    let pixel = vec2i(sample * dome.sample_pixels);
    let depth = textureLoad(depths, pixel, 0);
    let facing = textureLoad(normals, pixel, 0);
    // The alpha of the normal is the kind of surface.
    return Surface(
        world_position(view.world_from_clip, view.main_pass_viewport, vec2f(pixel) + sample_position(), depth),
        normalize(facing.xyz * 2.0 - 1.0),
        depth > 0.0 && abs(facing.a - IS_PHANTOM) < 0.1, depth > 0.0 && abs(facing.a - IS_VIRTUAL) < 0.1,
    );
}

#ifdef TALLY
/// Packs sums. At a phantom: `left` is the luminance past other phantoms including their own light, `open` that of
/// the open sky.
fn pack(total: LightSums, left: f32, open: f32) -> vec4u {
    return vec4u(
        pack2x16float(total.unshadowed.rg), pack2x16float(vec2f(total.unshadowed.b, total.shadowed.r)),
        pack2x16float(total.shadowed.gb), pack2x16float(vec2f(left, open)),
    );
}

@compute @workgroup_size(8, 8)
fn accumulate(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(partial_sums)) {
        return;
    }
    let here = surface_at(id.xy);
    let quarter = RankSubset(id.x % SQUARE_EDGE + SQUARE_EDGE * (id.y % SQUARE_EDGE), SQUARE_EDGE * SQUARE_EDGE);
    var result = vec4u(0u);
    if here.is_phantom {
        let total = accumulate_phantom(here.pos_world, here.normal, quarter);
        var left = LightSums();
        if has_lamps() {
            left = accumulate_surface(here.pos_world, here.normal, true, quarter);
        }
        result = pack(total, luminance(left.shadowed), luminance(left.unshadowed));
    } else if here.is_virtual {
        result = pack(accumulate_surface(here.pos_world, here.normal, false, quarter), 0.0, 0.0);
    }
    textureStore(partial_sums, id.xy, result);
}
#endif

#ifdef GATHER
/// Sums over all directions; at a phantom also the luminances that `accumulate` has packed.
struct Gathered {
    total: LightSums,
    left: f32,
    open: f32,
}

/// Sums over 3 × 3 samples with the weights 1 2 1, 2 4 2, 1 2 1, so that each position in a square has the same total
/// weight.
fn gather_sums(sample: vec2u, here: Surface) -> Gathered {
    let pixels = f32(dome.sample_pixels);
    let first = vec2i(ceil(view.viewport.xy / pixels));
    let last = max(vec2i(floor((view.viewport.xy + view.viewport.zw - 1.0) / pixels)), first);
    var sums = array<vec4f, 2>();
    var quarters = 0.0;
    for (var place = 0; place < 4; place++) {
        let aside = vec2i(place & 1, place >> 1u);
        var low = vec4f(0.0);
        var high = vec4f(0.0);
        var weights = 0.0;
        for (var i = 0; i < (1 << u32(aside.x + aside.y)); i++) {
            let sign = 1 - 2 * vec2i(i & 1, (i >> u32(aside.x)) & 1);
            // Beyond the border of the viewport, mirrored samples read the same directions.
            let beside = vec2i(sample) + sign * aside;
            let inside = select(beside, 2 * first - beside, beside < first);
            let neighbor = vec2u(clamp(select(inside, 2 * last - inside, inside > last), first, last));
            let there = surface_at(neighbor);
            let is_same = here.is_phantom == there.is_phantom && here.is_virtual == there.is_virtual;
            let weight = select(0.0, surface_similarity(
                there.pos_world - here.pos_world,
                here.normal,
                there.normal,
                distance(here.pos_world, view.world_position),
            ), is_same);
            let packed = textureLoad(partial_sums, neighbor, 0);
            low += weight * vec4f(unpack2x16float(packed.x), unpack2x16float(packed.y));
            high += weight * vec4f(unpack2x16float(packed.z), unpack2x16float(packed.w));
            weights += weight;
        }
        // A position in the square with hardly any weight is replaced by the others.
        let trust = min(weights, 1.0) / max(weights, 1e-6);
        sums[0] += trust * low;
        sums[1] += trust * high;
        quarters += min(weights, 1.0);
    }
    let scale = f32(SQUARE_EDGE * SQUARE_EDGE) / max(quarters, 1e-6);
    let low = scale * sums[0];
    let high = scale * sums[1];
    let total = LightSums(low.rgb, vec3f(low.a, high.rg), 0.0);
    return Gathered(total, high.b, high.a);
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= dome.visibility_size) {
        return;
    }
    let here = surface_at(id.xy);
    var result = vec4f(1.0);
    if here.is_phantom || here.is_virtual {
        let found = gather_sums(id.xy, here);
        if here.is_phantom {
            let keys = accumulate_phantom_keys(here.pos_world, here.normal);
            result = vec4f(phantom_factor(add_sums(found.total, keys)), 1.0);
            if has_lamps() {
                let real_keys = accumulate_surface_keys(here.pos_world, here.normal, true);
                let open = found.open + luminance(real_keys.unshadowed);
                let left = (found.left + luminance(real_keys.shadowed)) / max(open, 1e-20);
                result.a = luminance_fraction(vec3f(select(1.0, left, open > 1e-6)));
            }
        } else {
            let keys = accumulate_surface_keys(here.pos_world, here.normal, false);
            result = vec4f(surface_factor(add_sums(found.total, keys)), 1.0);
        }
    }
    store(id.xy, result);
}
#endif

#ifndef TALLY
#ifndef GATHER
@compute @workgroup_size(8, 8)
fn full(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= dome.visibility_size) {
        return;
    }
    let here = surface_at(id.xy);
    var result = vec4f(1.0);
    if here.is_phantom {
        result = vec4f(phantom_visibility(here.pos_world, here.normal), 1.0);
        if has_lamps() {
            result.a = luminance_fraction(real_visibility(here.pos_world, here.normal));
        }
    } else if here.is_virtual {
        result = vec4f(virtual_visibility(here.pos_world, here.normal), 1.0);
    }
    store(id.xy, result);
}
#endif
#endif
