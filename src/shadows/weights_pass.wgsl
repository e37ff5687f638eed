// Environment cube → radiance × solid angle of each direction of the dome.

#import bevy_mirrorball::shadows::dome::{DomeWeight, pack_light, unpack_light}

/// Mirror of `WeightsUniform` in weights_pass.rs.
struct Weights {
    cube_from_dome: mat3x3f,
    /// Directions with shadow maps, all directions, the first below the horizon and one past the last.
    counts: vec4u,
    /// Share of the light of the directions with shadow maps whose dimmest ones are left out.
    dim_share: f32,
    /// Mip level of the cube to look at.
    level: f32,
}

@group(0) @binding(0) var cube: texture_cube<f32>;
@group(0) @binding(1) var cube_sampler: sampler;
@group(0) @binding(2) var<uniform> uniforms: Weights;
/// Directions (dome frame) and solid angles of small patches of the sphere, those of one direction together.
@group(0) @binding(3) var<storage, read> patches: array<vec4f>;
@group(0) @binding(4) var<storage, read> ranges: array<vec2u>;
@group(0) @binding(5) var<storage, read_write> weights: array<DomeWeight>;

const THREADS: u32 = 64u;
var<workgroup> partial: array<vec3f, THREADS>;

fn sum_of_all_threads(thread: u32) -> vec3f {
    for (var stride = THREADS / 2u; stride > 0u; stride /= 2u) {
        workgroupBarrier();
        if thread < stride {
            partial[thread] += partial[thread + stride];
        }
    }
    workgroupBarrier();
    return partial[0];
}

/// One workgroup per direction.
@compute @workgroup_size(THREADS)
fn weigh_cells(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    let range = ranges[group.x];
    var sum = vec3f(0.0);
    for (var i = range.x + thread; i < range.y; i += THREADS) {
        let dir = uniforms.cube_from_dome * patches[i].xyz;
        sum += textureSampleLevel(cube, cube_sampler, dir * vec3f(1.0, 1.0, -1.0), uniforms.level).rgb * patches[i].w;
    }
    partial[thread] = sum;
    let total = sum_of_all_threads(thread);
    if thread == 0u {
        weights[group.x] = pack_light(total, 0u);
    }
}

/// One workgroup: the mean radiance below the horizon, behind the last direction.
@compute @workgroup_size(THREADS)
fn average_below(@builtin(local_invocation_index) thread: u32) {
    var sum = vec3f(0.0);
    for (var i = uniforms.counts.z + thread; i < uniforms.counts.w; i += THREADS) {
        sum += unpack_light(weights[i]);
    }
    partial[thread] = sum;
    let total = sum_of_all_threads(thread);
    if thread == 0u {
        weights[uniforms.counts.y] = pack_light(total / 6.28318530718, 0u);
    }
}

fn luminance(index: u32) -> f32 {
    return dot(unpack_light(weights[index]), vec3f(0.2126, 0.7152, 0.0722));
}

/// One workgroup: which directions with shadow maps come first by what they give, and how many are worth a look.
@compute @workgroup_size(THREADS)
fn rank_directions(@builtin(local_invocation_index) thread: u32) {
    let count = uniforms.counts.x;
    var bright = 0.0;
    for (var i = thread; i < count; i += THREADS) {
        let own = luminance(i);
        var rank = 0u;
        var total = 0.0;
        var brighter = 0.0;
        for (var k = 0u; k < count; k++) {
            let other = luminance(k);
            let comes_first = other > own || (other == own && k < i);
            rank += u32(comes_first);
            brighter += select(0.0, other, comes_first);
            total += other;
        }
        weights[rank].ranked = i;
        // The dimmest together give the dim share; a direction is one of them if it and all after it are within.
        bright += f32(total - brighter > uniforms.dim_share * total);
    }
    partial[thread] = vec3f(bright);
    let all_bright = sum_of_all_threads(thread);
    if thread == 0u {
        weights[uniforms.counts.y].ranked = u32(all_bright.x);
    }
}
