// Samples of a camera's prepass for the visibility pass, and how its threads are spread over them. Each sample reads
// every STEPth direction.
//
// Definitions: MULTISAMPLED: the prepass is. INTERLEAVED: each of 2 × 2 samples reads a quarter of the directions.

#define_import_path bevy_mirrorball::shadows::render::visibility_surfaces

#import bevy_render::view::View
#import bevy_mirrorball::shadows::render::bindings::dome
#import bevy_mirrorball::shadows::render::samples::{
    PHANTOM_BITS, VIRTUAL_BITS, VisibilitySample, first_sample, kind_of, pack_facing, unpack_normal, world_position,
}

@group(0) @binding(0) var<uniform> view: View;
#ifdef MULTISAMPLED
@group(0) @binding(1) var depths: texture_depth_multisampled_2d;
@group(0) @binding(2) var normals: texture_multisampled_2d<f32>;
#else
@group(0) @binding(1) var depths: texture_depth_2d;
@group(0) @binding(2) var normals: texture_2d<f32>;
#endif
@group(0) @binding(3) var<storage, read_write> samples: array<VisibilitySample>;

#ifdef INTERLEAVED
/// Edge in samples of a square in which each direction is read once.
const SQUARE_EDGE: u32 = 2u;
#else
const SQUARE_EDGE: u32 = 1u;
#endif
/// Every how many directions a sample reads.
const STEP: u32 = SQUARE_EDGE * SQUARE_EDGE;
/// Edge of a workgroup, and of the tile with its border that `gather` and `find_changes` look at.
const TILE: u32 = 8u;
const BORDERED: u32 = TILE + 2u;

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
    /// Bits of the kind and the normal.
    facing: u32,
    depth: f32,
}

fn is_receiver(here: Surface) -> bool {
    return kind_of(here.facing) == PHANTOM_BITS || kind_of(here.facing) == VIRTUAL_BITS;
}

fn is_phantom(here: Surface) -> bool {
    return kind_of(here.facing) == PHANTOM_BITS;
}

fn surface_at(sample: vec2u) -> Surface {
    let pixel = vec2i(sample * dome.sample_pixels);
    let depth = textureLoad(depths, pixel, 0);
    let facing = pack_facing(textureLoad(normals, pixel, 0), depth);
    let place = vec2f(pixel) + sample_position();
    let pos_world = world_position(view.world_from_clip, view.main_pass_viewport, place, depth);
    return Surface(pos_world, unpack_normal(facing), facing, depth);
}

fn index_of(sample: vec2u) -> u32 {
    return sample.y * dome.visibility_size.x + sample.x;
}

/// Which of the directions a sample reads.
fn place_in_square(sample: vec2u) -> u32 {
    return sample.x % SQUARE_EDGE + SQUARE_EDGE * (sample.y % SQUARE_EDGE);
}

/// Sample at a place of a tile and its border. Beyond the border of all samples, the nearest one.
fn bordered_sample(tile: vec2u, cell: u32) -> vec2u {
    let place = vec2i(tile * TILE) + vec2i(vec2u(cell % BORDERED, cell / BORDERED)) - 1;
    return vec2u(clamp(place, vec2i(0), vec2i(dome.visibility_size) - 1));
}
