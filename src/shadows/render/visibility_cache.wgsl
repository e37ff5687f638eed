// What the visibility pass keeps from frame to frame: lookups of shadow maps, and the order and the lists of
// directions.

#define_import_path bevy_mirrorball::shadows::render::visibility_cache

#import bevy_mirrorball::shadows::render::bindings::{dome, results}
#import bevy_mirrorball::shadows::render::maps::axes_of
#import bevy_mirrorball::shadows::render::visibility::{Light, is_key}
#import bevy_mirrorball::shadows::render::visibility_surfaces::STEP

/// Maximum number of directions with shadow maps, the same with key lights, and of words with a bit for each of these.
/// Twins of the constants in `visibility_cache.rs`.
const MAX_DIRECTIONS: u32 = 1024u;
const MAX_SHADOW_MAPS: u32 = 1032u;
const CHANGE_WORDS: u32 = 36u;
/// Maximum number of workgroups along the first axis of an indirect dispatch.
const GROUP_ROW: u32 = 1024u;

/// Mirror of `ChangesUniform` in `visibility_cache.rs`.
struct Changes {
    /// A bit per direction and key light whose shadow map was drawn since the last time.
    redrawn: array<vec4u, CHANGE_WORDS / 4u>,
    /// Bits of key lights that are there, and of those whose shadow map was drawn.
    keys: u32,
    redrawn_keys: u32,
    /// 1 if nothing holds that was looked up.
    is_new: u32,
    /// 1 if the sums of all samples are to be computed again.
    sums_all: u32,
    /// 1 if the light has come to rest.
    is_at_rest: u32,
}

struct Plan {
    /// Number of listed tiles.
    tile_count: atomic<u32>,
    /// Numbers of listed directions per place in a square: of all that are bright, and of those whose lookups no longer
    /// hold. They are listed by their place in the order.
    all_counts: array<atomic<u32>, STEP>,
    fresh_counts: array<atomic<u32>, STEP>,
    /// The lists, one behind the other.
    all: array<u32, MAX_SHADOW_MAPS>,
    fresh: array<u32, MAX_SHADOW_MAPS>,
    /// Directions and key lights in the order in which samples take turns in reading them.
    order: array<u32, MAX_SHADOW_MAPS>,
    /// Rank by light of each of them.
    ranks: array<u32, MAX_SHADOW_MAPS>,
    /// Directions in this order, then those below the horizon: 16-bit fractions of the unit vector, and 16-bit floats
    /// of the solid angle and the light; then LOOKED_UP.
    directions: array<vec4u, MAX_SHADOW_MAPS + MAX_DIRECTIONS>,
    /// Listed tiles, 16 bits per axis.
    tiles: array<u32>,
}

/// Visibility in eight bits past phantoms and past virtual casters, two directions per word: a plane of words per pair
/// of the directions that a sample reads, then per pair of key lights.
@group(0) @binding(5) var<storage, read_write> lookups: array<u32>;
@group(0) @binding(6) var<storage, read_write> plan: Plan;
@group(0) @binding(7) var<uniform> changes: Changes;

/// Bit of a direction whose visibility is looked up. The others are not shadowed.
const LOOKED_UP: u32 = 0x10000u;

/// Key lights are summed separately and count nothing here.
fn pack_direction(index: u32, is_looked_up: bool) -> vec4u {
    let dir = axes_of(index).direction;
    let weight = results.weights[index];
    if is_key(index) {
        return vec4u(0u);
    }
    let solid_angle = weight.b_solid_angle >> 16u;
    return vec4u(
        pack2x16snorm(dir.xy), (pack2x16snorm(vec2f(dir.z, 0.0)) & 0xffffu) | (solid_angle << 16u), weight.rg,
        (weight.b_solid_angle & 0xffffu) | select(0u, LOOKED_UP, is_looked_up),
    );
}

fn far_light(direction: vec4u, normal: vec3f) -> Light {
    let dir = vec3f(unpack2x16snorm(direction.x), unpack2x16snorm(direction.y).x);
    let irradiance = vec3f(unpack2x16float(direction.z), unpack2x16float(direction.w & 0xffffu).x);
    let cos_angle = dot(normal, dir);
    return Light(irradiance, cos_angle, irradiance, cos_angle, unpack2x16float(direction.y).y);
}

fn word_of(at: u32, slot: u32) -> u32 {
    return (slot / 2u) * dome.visibility_size.x * dome.visibility_size.y + at;
}

fn store_lookup(at: u32, slot: u32, past: vec2f) {
    let word = word_of(at, slot);
    let bytes = vec2u(round(saturate(past) * 255.0));
    lookups[word] = insertBits(lookups[word], bytes.x | (bytes.y << 8u), 16u * (slot % 2u), 16u);
}

fn load_lookup(at: u32, slot: u32) -> vec2f {
    let bytes = lookups[word_of(at, slot)] >> (16u * (slot % 2u));
    return vec2f(vec2u(bytes, bytes >> 8u) & vec2u(255u)) / 255.0;
}

fn slot_of_key(key: u32) -> u32 {
    return (dome.shadow_map_count + STEP - 1u) / STEP + key;
}

/// Tile of a workgroup in an indirect dispatch.
fn listed_tile(group: vec3u) -> vec2u {
    let place = group.y * GROUP_ROW + group.x;
    let is_there = place < atomicLoad(&plan.tile_count);
    let tile = plan.tiles[select(0u, place, is_there)];
    return select(vec2u(0xffffu), vec2u(tile & 0xffffu, tile >> 16u), is_there);
}
