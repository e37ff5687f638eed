// Fraction of light that arrives at the surface of the prepass, one thread per sample, 8 × 8 samples per workgroup.
//
// Definitions: those of maps.wgsl, visibility.wgsl and visibility_surfaces.wgsl. With INTERLEAVED, each of 2 × 2
// samples sums over a quarter of the directions in `accumulate` and takes the sums over the others from its neighbors
// in `gather` (after Keller and Heidrich 2001, *Interleaved sampling*). Key lights have shadows with edges, so every
// sample reads all of them. CACHED: shadow maps have been looked up by visibility_plan_pass.wgsl.

#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::shadows::render::bindings::dome
#import bevy_mirrorball::shadows::render::maps::has_lamps
#import bevy_mirrorball::shadows::render::samples::{kind_of, surface_similarity, unpack_normal}
#import bevy_mirrorball::shadows::render::tile_surfels::{bounced_light_in_tile, find_surfels}
#import bevy_mirrorball::shadows::render::visibility::{
    Light, LightSums, RankSubset, accumulate_phantom, accumulate_phantom_keys, accumulate_surface,
    accumulate_surface_keys, add_sums, hidden_radiance_at, incoming_key_light, incoming_light,
    is_key, luminance_fraction, phantom_factor, phantom_term, surface_factor, surface_term, with_bounced_light,
}
#ifdef CACHED
#import bevy_mirrorball::shadows::render::visibility_cache::{
    LOOKED_UP, changes, far_light, listed_tile, load_lookup, plan, slot_of_key,
}
#endif
#import bevy_mirrorball::shadows::render::visibility_surfaces::{
    BORDERED, STEP, Surface, TILE, bordered_sample, index_of, is_phantom, is_receiver, place_in_square, samples,
    surface_at, view,
}

/// Sums over a quarter of the directions: eight 16-bit floats per sample.
@group(0) @binding(4) var<storage, read_write> partial_sums: array<vec4u>;

/// Sums at a sample. At a phantom, also the luminance that other phantoms leave, including their own light, and that of
/// the open sky, if there are lamps to compare with.
struct SampleSums {
    total: LightSums,
    left: f32,
    open: f32,
}

fn with_term(sums: SampleSums, light: Light, past: vec2f, hidden: vec3f, here: Surface) -> SampleSums {
    var result = sums;
    if is_phantom(here) {
        if light.cos_angle > 0.0 {
            result.total = add_sums(result.total, phantom_term(light, past));
        }
        if has_lamps() {
            let left = surface_term(light, vec2f(past.x, 1.0), hidden);
            result.left += luminance(left.shadowed);
            result.open += luminance(left.unshadowed);
        }
    } else {
        result.total = add_sums(result.total, surface_term(light, past, hidden));
    }
    return result;
}

#ifdef CACHED
#ifdef SPOTS
fn near_or_far_light(direction: vec4u, slot: u32, here: Surface) -> Light {
    var index = slot;
    if slot < dome.shadow_map_count {
        index = plan.order[slot];
    }
    if dome.views[index].scale < 0.0 && !is_key(index) {
        return incoming_light(index, here.pos_world, here.normal).light;
    }
    return far_light(direction, here.normal);
}
#endif

/// Tile whose sums a workgroup computes: every one, or a listed one.
fn tile_to_sum(group: vec3u) -> vec2u {
    if changes.sums_all != 0u {
        return group.xy;
    }
    return listed_tile(group);
}

fn sum_directions(sample: vec2u, here: Surface) -> SampleSums {
    let count = select(0u, dome.direction_count, is_receiver(here));
    let hidden = hidden_radiance_at(is_phantom(here));
    var sums = SampleSums();
    for (var slot = place_in_square(sample); slot < count; slot += STEP) {
        let direction = plan.directions[slot];
        var past = vec2f(1.0);
        if (direction.w & LOOKED_UP) != 0u {
            past = load_lookup(index_of(sample), slot / STEP);
        }
#ifdef SPOTS
        let light = near_or_far_light(direction, slot, here);
#else
        let light = far_light(direction, here.normal);
#endif
        sums = with_term(sums, light, past, hidden, here);
    }
    return sums;
}

fn sum_key_lights(sample: vec2u, here: Surface) -> SampleSums {
    let hidden = hidden_radiance_at(is_phantom(here));
    var sums = SampleSums();
    var left = select(0u, changes.keys, is_receiver(here));
    while left != 0u {
        let key = countTrailingZeros(left);
        let past = load_lookup(index_of(sample), slot_of_key(key));
        let light = incoming_key_light(dome.first_key + key, here.pos_world, here.normal).light;
        sums = with_term(sums, light, past, hidden, here);
        left &= left - 1u;
    }
    return sums;
}
#else
fn tile_to_sum(group: vec3u) -> vec2u {
    return group.xy;
}

/// Luminances of the sums at a real surface, which lamps are compared with.
fn with_left(total: LightSums, left: LightSums) -> SampleSums {
    return SampleSums(total, luminance(left.shadowed), luminance(left.unshadowed));
}

fn sum_directions(sample: vec2u, here: Surface) -> SampleSums {
    let ranks = RankSubset(place_in_square(sample), STEP);
    if is_phantom(here) {
        var left = LightSums();
        if has_lamps() {
            left = accumulate_surface(here.pos_world, here.normal, true, ranks);
        }
        return with_left(accumulate_phantom(here.pos_world, here.normal, ranks), left);
    }
    if !is_receiver(here) {
        return SampleSums();
    }
    return with_left(accumulate_surface(here.pos_world, here.normal, false, ranks), LightSums());
}

fn sum_key_lights(sample: vec2u, here: Surface) -> SampleSums {
    if is_phantom(here) {
        var left = LightSums();
        if has_lamps() {
            left = accumulate_surface_keys(here.pos_world, here.normal, true);
        }
        return with_left(accumulate_phantom_keys(here.pos_world, here.normal), left);
    }
    return with_left(accumulate_surface_keys(here.pos_world, here.normal, false), LightSums());
}
#endif

/// Stores the fraction of light that arrives at a surface.
fn store_fraction(at: u32, here: Surface, directions: SampleSums, keys: SampleSums) {
    let total = add_sums(directions.total, keys.total);
    var fraction = vec4f(1.0);
    if is_phantom(here) {
        fraction = vec4f(phantom_factor(total), 1.0);
        if has_lamps() {
            let open = directions.open + keys.open;
            let left = (directions.left + keys.left) / max(open, 1e-20);
            fraction.a = luminance_fraction(vec3f(select(1.0, left, open > 1e-6)));
        }
    } else if is_receiver(here) {
        fraction = vec4f(surface_factor(total), 1.0);
    }
    samples[at].fraction = vec2u(pack2x16float(fraction.rg), pack2x16float(fraction.ba));
}

@compute @workgroup_size(TILE, TILE)
fn accumulate(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let sample = tile_to_sum(group) * TILE + local.xy;
    let is_inside = all(sample < dome.visibility_size);
    var here = Surface();
    if is_inside {
        here = surface_at(sample);
    }
    find_surfels(here, is_inside && is_receiver(here), thread);
    if !is_inside {
        return;
    }
    let at = index_of(sample);
    samples[at].pos_world = here.pos_world;
    samples[at].facing = here.facing;
    samples[at].depth = here.depth;
    var sums = sum_directions(sample, here);
    if is_receiver(here) {
        sums.total = with_bounced_light(sums.total, bounced_light_in_tile(sample, here));
    }
#ifdef INTERLEAVED
    let total = sums.total;
    partial_sums[at] = vec4u(
        pack2x16float(total.unshadowed.rg), pack2x16float(vec2f(total.unshadowed.b, total.shadowed.r)),
        pack2x16float(total.shadowed.gb), pack2x16float(vec2f(sums.left, sums.open)),
    );
#else
    store_fraction(at, here, sums, sum_key_lights(sample, here));
#endif
}

#ifdef INTERLEAVED
/// Samples of the tile and of its border.
var<workgroup> near_places: array<vec3f, BORDERED * BORDERED>;
var<workgroup> near_facings: array<u32, BORDERED * BORDERED>;

/// Sums over 3 × 3 samples with the weights 1 2 1, 2 4 2, 1 2 1, so that each position in a square has the same total
/// weight.
fn gather_sums(tile: vec2u, sample: vec2u, here: Surface) -> SampleSums {
    let pixels = f32(dome.sample_pixels);
    let first = vec2i(ceil(view.viewport.xy / pixels));
    let last = max(vec2i(floor((view.viewport.xy + view.viewport.zw - 1.0) / pixels)), first);
    let distance_to_camera = distance(here.pos_world, view.world_position);
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
            let in_tile = vec2u(clamp(vec2i(neighbor) - vec2i(tile * TILE) + 1, vec2i(0), vec2i(i32(BORDERED) - 1)));
            let cell = in_tile.y * BORDERED + in_tile.x;
            let facing = near_facings[cell];
            let weight = select(0.0, surface_similarity(
                near_places[cell] - here.pos_world, here.normal, unpack_normal(facing), distance_to_camera,
            ), kind_of(here.facing) == kind_of(facing));
            let packed = partial_sums[index_of(neighbor)];
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
    let scale = f32(STEP) / max(quarters, 1e-6);
    let low = scale * sums[0];
    let high = scale * sums[1];
    return SampleSums(LightSums(low.rgb, vec3f(low.a, high.rg), 0.0), high.b, high.a);
}

@compute @workgroup_size(TILE, TILE)
fn gather(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_id) local: vec3u,
    @builtin(local_invocation_index) thread: u32,
) {
    let tile = tile_to_sum(group);
    for (var cell = thread; cell < BORDERED * BORDERED; cell += TILE * TILE) {
        let at = index_of(bordered_sample(tile, cell));
        near_places[cell] = samples[at].pos_world;
        near_facings[cell] = samples[at].facing;
    }
    workgroupBarrier();
    let sample = tile * TILE + local.xy;
    if any(sample >= dome.visibility_size) {
        return;
    }
    let own = (local.y + 1u) * BORDERED + local.x + 1u;
    let facing = near_facings[own];
    let here = Surface(near_places[own], unpack_normal(facing), facing, 0.0);
    store_fraction(index_of(sample), here, gather_sums(tile, sample, here), sum_key_lights(sample, here));
}
#endif
