// Environment cube → radiance × solid angle of each direction of the dome, and the order of the directions by their
// light.

#import bevy_mirrorball::shadows::render::dome::{DomeWeight, pack_light, unpack_light, unpack_solid_angle}
#import bevy_mirrorball::environment_map::cubemap::sample_faces
#import bevy_mirrorball::luminance::luminance

/// Mirror of `WeightsUniform` in `weights_pipeline.rs`.
struct Weights {
    cube_from_dome: mat3x3f,
    /// Numbers of directions with shadow maps, key lights, and other directions.
    counts: vec3u,
    /// Fraction of the light of the directions with shadow maps that the unshadowed, dimmest ones may have in total.
    dim_share: f32,
    /// Mip level of the cube to read.
    level: u32,
}

@group(0) @binding(0) var cube: texture_2d_array<f32>;
@group(0) @binding(1) var<uniform> uniforms: Weights;
/// Directions (in the dome's frame) and solid angles of small patches of the sphere, grouped by cell.
@group(0) @binding(2) var<storage, read> patches: array<vec4f>;
/// Per direction: the first patch and one past the last; z: 1 if the direction is below the horizon.
@group(0) @binding(3) var<storage, read> ranges: array<vec4u>;
/// Weights of directions with shadow maps, key lights, other directions, then the mean below the horizon.
@group(0) @binding(4) var<storage, read_write> weights: array<DomeWeight>;
/// Directions of key lights (in the dome's frame), and cosines of the radii of their cones.
@group(0) @binding(5) var<storage, read> keys: array<vec4f>;

const THREADS: u32 = 64u;
var<workgroup> partial: array<vec4f, THREADS>;

fn sum_of_all_threads(thread: u32) -> vec4f {
    for (var stride = THREADS / 2u; stride > 0u; stride /= 2u) {
        workgroupBarrier();
        if thread < stride {
            partial[thread] += partial[thread + stride];
        }
    }
    workgroupBarrier();
    return partial[0];
}

/// Index of the key light whose cone contains a direction, or the number of key lights if there is none.
fn key_of(dir: vec3f) -> u32 {
    for (var key = 0u; key < uniforms.counts.y; key++) {
        if dot(keys[key].xyz, dir) > keys[key].w {
            return key;
        }
    }
    return uniforms.counts.y;
}

/// Sum over the patches of a range that belong to a key light, or to none: radiance × solid angle, and solid angle.
fn weigh(first: u32, end: u32, key: u32, thread: u32) -> vec4f {
    var sum = vec4f(0.0);
    for (var i = first + thread; i < end; i += THREADS) {
        let place = patches[i];
        if key_of(place.xyz) == key {
            let dir = uniforms.cube_from_dome * place.xyz;
            let radiance = sample_faces(cube, dir * vec3f(1.0, 1.0, -1.0), uniforms.level).rgb;
            sum += vec4f(radiance, 1.0) * place.w;
        }
    }
    partial[thread] = sum;
    return sum_of_all_threads(thread);
}

/// One workgroup per direction, then one per key light, which takes its light from all cells that its cone touches.
@compute @workgroup_size(THREADS)
fn weigh_cells(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let direction_count = uniforms.counts.x + uniforms.counts.z;
    var first = 0u;
    var end = arrayLength(&patches);
    var key = group.x - direction_count;
    var index = uniforms.counts.x + key;
    if group.x < direction_count {
        let range = ranges[group.x];
        first = range.x;
        end = range.y;
        key = uniforms.counts.y;
        index = select(group.x + uniforms.counts.y, group.x, group.x < uniforms.counts.x);
    }
    let total = weigh(first, end, key, thread);
    if thread == 0u {
        weights[index] = pack_light(total.rgb, total.w, 0u);
    }
}

/// One workgroup: writes the mean radiance below the horizon behind the last direction.
@compute @workgroup_size(THREADS)
fn average_below(@builtin(local_invocation_index) thread: u32) {
    let count = uniforms.counts.x + uniforms.counts.z;
    var sum = vec4f(0.0);
    for (var i = thread; i < count; i += THREADS) {
        let weight = weights[select(i + uniforms.counts.y, i, i < uniforms.counts.x)];
        sum += vec4f(unpack_light(weight), unpack_solid_angle(weight)) * f32(ranges[i].z);
    }
    partial[thread] = sum;
    let total = sum_of_all_threads(thread);
    if thread == 0u {
        weights[count + uniforms.counts.y] = pack_light(total.rgb / max(total.w, 1e-6), 0.0, 0u);
    }
}

fn luminance_of(index: u32) -> f32 {
    return luminance(unpack_light(weights[index]));
}

/// One workgroup: ranks the directions with shadow maps by luminance, and counts those bright enough for a lookup.
@compute @workgroup_size(THREADS)
fn rank_directions(@builtin(local_invocation_index) thread: u32) {
    let count = uniforms.counts.x + uniforms.counts.y;
    var bright = 0.0;
    for (var i = thread; i < count; i += THREADS) {
        let own = luminance_of(i);
        var rank = 0u;
        var total = 0.0;
        var brighter = 0.0;
        for (var k = 0u; k < count; k++) {
            let other = luminance_of(k);
            let comes_first = other > own || (other == own && k < i);
            rank += u32(comes_first);
            brighter += select(0.0, other, comes_first);
            total += other;
        }
        weights[rank].ranked = i;
        // A direction is dim if it and all dimmer ones together have at most this fraction of the light.
        bright += f32(total - brighter > uniforms.dim_share * total);
    }
    partial[thread] = vec4f(bright);
    let all_bright = sum_of_all_threads(thread);
    if thread == 0u {
        weights[count + uniforms.counts.z].ranked = u32(all_bright.x);
    }
}
