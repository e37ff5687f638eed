// Lookups of shadow maps that the visibility pass keeps: which of them no longer hold, and these anew.
//
// What a sample has looked up holds as long as it shows the same point of the same surface and nothing is drawn into
// the shadow map. `make_plan` lists the directions whose lookups no longer hold, `find_changes` lists the tiles of
// samples that show something else than before, and only these are looked up: in the listed tiles all directions, in
// the others those listed. Colors of light are no part of this, so a light that changes costs a sum and no lookup.

#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::shadows::render::bindings::{dome, results}
#import bevy_mirrorball::shadows::render::dome::unpack_light
#import bevy_mirrorball::shadows::render::samples::pack_facing
#import bevy_mirrorball::shadows::render::visibility::{
    bright_directions, direction_visibility, incoming_key_light, incoming_light, is_key, key_light_visibility,
}
#import bevy_mirrorball::shadows::render::visibility_cache::{
    GROUP_ROW, LOOKED_UP, MAX_SHADOW_MAPS, changes, listed_tile, pack_direction, plan, slot_of_key, store_lookup,
}
#import bevy_mirrorball::shadows::render::visibility_surfaces::{
    BORDERED, STEP, TILE, bordered_sample, depths, index_of, is_phantom, is_receiver, normals, place_in_square, samples,
    surface_at,
}

/// Workgroups of the indirect dispatches: for listed tiles, then for listed directions.
@group(2) @binding(0) var<storage, read_write> groups: array<atomic<u32>, 6>;
/// Index of the latter. Twin of `FRESH_GROUPS_OFFSET` in `visibility_cache.rs`.
const FRESH_GROUPS: u32 = 3u;

/// Number of directions in each list.
const LIST_LENGTH: u32 = MAX_SHADOW_MAPS / STEP;

fn has_bit(words: vec4u, index: u32) -> bool {
    return (words[(index / 32u) % 4u] & (1u << (index % 32u))) != 0u;
}

const PLANNERS: u32 = 64u;

/// Difference between the light of the places in a square, as a fraction of their mean, by which an order may be worse
/// than that by light.
const MAX_IMBALANCE: f32 = 0.1;
var<workgroup> shares: array<vec2f, PLANNERS>;
var<workgroup> is_unbalanced: u32;

/// Ranks all directions, and decides whether samples read them in this order from now on. Each place in a square should
/// read as much light as the others; but a new order outdates lookups. So the last order stays while the light changes,
/// as long as it divides the light almost as well.
fn is_out_of_order(thread: u32) -> bool {
    var share = vec2f(0.0);
    for (var rank = thread; rank < dome.shadow_map_count; rank += PLANNERS) {
        let index = results.weights[rank].ranked;
        let other = min(plan.order[rank], dome.shadow_map_count - 1u);
        plan.ranks[index] = rank;
        share += vec2f(select(light_of(index), 0.0, is_key(index)), select(light_of(other), 0.0, is_key(other)));
    }
    shares[thread] = share;
    workgroupBarrier();
    if thread == 0u {
        var low = vec2f(1e30);
        var high = vec2f(0.0);
        var total = 0.0;
        for (var place = 0u; place < STEP; place++) {
            var sum = vec2f(0.0);
            for (var i = place; i < PLANNERS; i += STEP) {
                sum += shares[i];
            }
            low = min(low, sum);
            high = max(high, sum);
            total += sum.x;
        }
        let spread = high - low;
        is_unbalanced = u32(spread.y > spread.x + MAX_IMBALANCE * total / f32(STEP));
    }
    workgroupBarrier();
    storageBarrier();
    return (changes.is_new | changes.is_at_rest | is_unbalanced) != 0u;
}

fn light_of(index: u32) -> f32 {
    return luminance(unpack_light(results.weights[index]));
}

/// One workgroup: lists directions, and begins the list of tiles.
@compute @workgroup_size(PLANNERS)
fn make_plan(@builtin(local_invocation_index) thread: u32) {
    if thread < STEP {
        atomicStore(&plan.all_counts[thread], 0u);
        atomicStore(&plan.fresh_counts[thread], 0u);
    }
    if thread == 0u {
        atomicStore(&plan.tile_count, 0u);
        atomicStore(&groups[0], 0u);
        atomicStore(&groups[1], 0u);
        atomicStore(&groups[2], 1u);
        atomicStore(&groups[FRESH_GROUPS], 0u);
        atomicStore(&groups[FRESH_GROUPS + 1u], 0u);
        atomicStore(&groups[FRESH_GROUPS + 2u], 1u);
    }
    workgroupBarrier();
    let is_reordered = is_out_of_order(thread);
    let bright = bright_directions();
    for (var slot = thread; slot < dome.direction_count; slot += PLANNERS) {
        var index = slot;
        var is_looked_up = false;
        var is_kept = false;
        if slot < dome.shadow_map_count {
            index = select(plan.order[slot], results.weights[slot].ranked, is_reordered);
            is_looked_up = plan.ranks[index] < bright && !is_key(index);
            is_kept = plan.order[slot] == index && (plan.directions[slot].w & LOOKED_UP) != 0u
                && !has_bit(changes.redrawn[index / 128u], index);
            plan.order[slot] = index;
        }
        plan.directions[slot] = pack_direction(index, is_looked_up);
        if is_looked_up {
            let place = slot % STEP;
            plan.all[place * LIST_LENGTH + atomicAdd(&plan.all_counts[place], 1u)] = slot;
            if !is_kept {
                plan.fresh[place * LIST_LENGTH + atomicAdd(&plan.fresh_counts[place], 1u)] = slot;
            }
        }
    }
    workgroupBarrier();
    storageBarrier();
    if thread < STEP && atomicLoad(&plan.fresh_counts[thread]) > 0u {
        let tiles = (dome.visibility_size + TILE - 1u) / TILE;
        atomicStore(&groups[FRESH_GROUPS], tiles.x);
        atomicStore(&groups[FRESH_GROUPS + 1u], tiles.y);
    }
}

var<workgroup> is_changed: atomic<u32>;

/// Lists the tile if it or its border shows something else than before.
@compute @workgroup_size(TILE, TILE)
fn find_changes(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    if thread == 0u {
        atomicStore(&is_changed, 0u);
    }
    workgroupBarrier();
    for (var cell = thread; cell < BORDERED * BORDERED; cell += TILE * TILE) {
        let sample = bordered_sample(group.xy, cell);
        let pixel = vec2i(sample * dome.sample_pixels);
        let depth = textureLoad(depths, pixel, 0);
        let facing = pack_facing(textureLoad(normals, pixel, 0), depth);
        let at = index_of(sample);
        if depth != samples[at].depth || facing != samples[at].facing {
            atomicStore(&is_changed, 1u);
        }
    }
    workgroupBarrier();
    if thread == 0u && (atomicLoad(&is_changed) | changes.is_new) != 0u {
        let place = atomicAdd(&plan.tile_count, 1u);
        plan.tiles[place] = group.x | (group.y << 16u);
        atomicMax(&groups[0], min(place + 1u, GROUP_ROW));
        atomicMax(&groups[1], place / GROUP_ROW + 1u);
    }
}

fn look_up_key_lights(sample: vec2u, keys: u32) {
    if any(sample >= dome.visibility_size) {
        return;
    }
    let here = surface_at(sample);
    var left = select(0u, keys, is_receiver(here));
    while left != 0u {
        let key = countTrailingZeros(left);
        let incoming = incoming_key_light(dome.first_key + key, here.pos_world, here.normal);
        store_lookup(
            index_of(sample), slot_of_key(key), key_light_visibility(incoming, here.normal, is_phantom(here)),
        );
        left &= left - 1u;
    }
}

/// Looks up all bright directions in the listed tiles.
@compute @workgroup_size(TILE, TILE)
fn look_up(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let sample = listed_tile(group) * TILE + local.xy;
    if any(sample >= dome.visibility_size) {
        return;
    }
    let here = surface_at(sample);
    let place = place_in_square(sample);
    let count = select(0u, atomicLoad(&plan.all_counts[place]), is_receiver(here));
    for (var i = 0u; i < count; i++) {
        let slot = plan.all[place * LIST_LENGTH + i];
        let incoming = incoming_light(plan.order[slot], here.pos_world, here.normal);
        store_lookup(index_of(sample), slot / STEP, direction_visibility(incoming, here.normal, is_phantom(here)));
    }
}

/// Looks up the directions whose lookups no longer hold, everywhere.
@compute @workgroup_size(TILE, TILE)
fn look_up_fresh(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= dome.visibility_size) {
        return;
    }
    let here = surface_at(id.xy);
    let place = place_in_square(id.xy);
    let count = select(0u, atomicLoad(&plan.fresh_counts[place]), is_receiver(here));
    for (var i = 0u; i < count; i++) {
        let slot = plan.fresh[place * LIST_LENGTH + i];
        let incoming = incoming_light(plan.order[slot], here.pos_world, here.normal);
        store_lookup(index_of(id.xy), slot / STEP, direction_visibility(incoming, here.normal, is_phantom(here)));
    }
}

@compute @workgroup_size(TILE, TILE)
fn look_up_keys(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    look_up_key_lights(listed_tile(group) * TILE + local.xy, changes.keys);
}

@compute @workgroup_size(TILE, TILE)
fn look_up_fresh_keys(@builtin(global_invocation_id) id: vec3u) {
    look_up_key_lights(id.xy, changes.redrawn_keys);
}
