// Surfels that send light to a tile of samples: those that face some of its places and lie above the horizon of some.
// Bounds of the places and normals of a tile leave out all others, half of them or more, which send nothing. What is
// left out changes no sum.
//
// Definitions: those of visibility_surfaces.wgsl.

#define_import_path bevy_mirrorball::shadows::render::tile_surfels

#import bevy_mirrorball::shadows::render::bindings::results
#import bevy_mirrorball::shadows::render::dome::MAX_SURFELS
#import bevy_mirrorball::shadows::render::surfels::{BouncedLight, add_bounced, light_of_surfel}
#import bevy_mirrorball::shadows::render::visibility_surfaces::{STEP, Surface, TILE, is_phantom, place_in_square}

/// Number of threads of a workgroup, no fewer than there are words in `found`.
const THREADS: u32 = TILE * TILE;
/// Number of words with a bit for each surfel that the samples at one place in a square read.
const WORDS: u32 = MAX_SURFELS / (32u * STEP);
/// Coordinate beyond that of any place, with products that are still finite.
const FAR: f32 = 1e15;

/// Smallest and largest coordinates of places and normals.
struct Bounds {
    low_place: vec3f,
    high_place: vec3f,
    low_normal: vec3f,
    high_normal: vec3f,
}

var<workgroup> thread_places: array<vec3f, THREADS>;
var<workgroup> thread_normals: array<vec3f, THREADS>;
var<workgroup> thread_receives: array<u32, THREADS>;
var<workgroup> row_bounds: array<Bounds, TILE>;
/// A bit per surfel. Those that the samples at one place in a square read are in successive words.
var<workgroup> found: array<atomic<u32>, MAX_SURFELS / 32u>;

fn no_bounds() -> Bounds {
    return Bounds(vec3f(FAR), vec3f(-FAR), vec3f(2.0), vec3f(-2.0));
}

fn bounds_of_row(row: u32) -> Bounds {
    var bounds = no_bounds();
    for (var i = row * TILE; i < (row + 1u) * TILE; i++) {
        if thread_receives[i] != 0u {
            bounds.low_place = min(bounds.low_place, thread_places[i]);
            bounds.high_place = max(bounds.high_place, thread_places[i]);
            bounds.low_normal = min(bounds.low_normal, thread_normals[i]);
            bounds.high_normal = max(bounds.high_normal, thread_normals[i]);
        }
    }
    return bounds;
}

fn bounds_of_tile() -> Bounds {
    var bounds = no_bounds();
    for (var row = 0u; row < TILE; row++) {
        let other = row_bounds[row];
        bounds.low_place = min(bounds.low_place, other.low_place);
        bounds.high_place = max(bounds.high_place, other.high_place);
        bounds.low_normal = min(bounds.low_normal, other.low_normal);
        bounds.high_normal = max(bounds.high_normal, other.high_normal);
    }
    return bounds;
}

/// Upper bound of the scalar product of two vectors within bounds.
fn largest_product(low: vec3f, high: vec3f, other_low: vec3f, other_high: vec3f) -> f32 {
    let largest = max(max(low * other_low, low * other_high), max(high * other_low, high * other_high));
    return largest.x + largest.y + largest.z;
}

fn may_send_light(i: u32, bounds: Bounds) -> bool {
    let surfel = results.lit.surfels[i];
    let low = surfel.pos_world - bounds.high_place;
    let high = surfel.pos_world - bounds.low_place;
    return largest_product(bounds.low_normal, bounds.high_normal, low, high) > 0.0
        && largest_product(-surfel.normal, -surfel.normal, low, high) > 0.0;
}

/// Finds the surfels for the workgroup's tile, of which each thread brings one sample. All threads call it.
fn find_surfels(here: Surface, receives: bool, thread: u32) {
    thread_places[thread] = here.pos_world;
    thread_normals[thread] = here.normal;
    thread_receives[thread] = u32(receives);
    if thread < MAX_SURFELS / 32u {
        atomicStore(&found[thread], 0u);
    }
    workgroupBarrier();
    if thread < TILE && results.lit.count > 0u {
        row_bounds[thread] = bounds_of_row(thread);
    }
    workgroupBarrier();
    if results.lit.count > 0u {
        let bounds = bounds_of_tile();
        let count = select(0u, results.lit.count, bounds.low_place.x <= bounds.high_place.x);
        for (var i = thread; i < count; i += THREADS) {
            if may_send_light(i, bounds) {
                let at = i / STEP;
                atomicOr(&found[(i % STEP) * WORDS + at / 32u], 1u << (at % 32u));
            }
        }
    }
    workgroupBarrier();
}

/// Irradiance at a sample from its share of the surfels that were found.
fn bounced_light_in_tile(sample: vec2u, here: Surface) -> BouncedLight {
    let place = place_in_square(sample);
    let words = (results.lit.count + 32u * STEP - 1u) / (32u * STEP);
    var sum = BouncedLight();
    for (var word = 0u; word < words; word++) {
        var left = atomicLoad(&found[place * WORDS + word]);
        while left != 0u {
            let i = (32u * word + countTrailingZeros(left)) * STEP + place;
            sum = add_bounced(sum, light_of_surfel(i, here.pos_world, here.normal, is_phantom(here)));
            left &= left - 1u;
        }
    }
    return sum;
}
