// Environment map → the fraction of the ambient light that comes from each of the directions that stand for it.

#import bevy_mirrorball::environment_map::cubemap::sample_faces
#import bevy_mirrorball::shadows::planar::render::planar_view::PlanarView

/// Mirror of `SkyUniform` in `sky_pipeline.rs`.
struct Sky {
    map_from_receiver: mat3x3f,
    /// Number of the first view, and number of views.
    first_view: u32,
    count: u32,
    /// Mip level of the map to read.
    level: u32,
}

@group(0) @binding(0) var faces: texture_2d_array<f32>;
@group(0) @binding(1) var<uniform> sky: Sky;
/// Directions in the receiver's frame, and solid angle × cosine, of small patches of the sky, grouped by view.
@group(0) @binding(2) var<storage, read> patches: array<vec4f>;
/// Per view: the first patch and one past the last.
@group(0) @binding(3) var<storage, read> ranges: array<vec2u>;
/// Directions of lights that are drawn for themselves, and cosines of the radii of their cones.
@group(0) @binding(4) var<storage, read> cones: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> views: array<PlanarView>;

const THREADS: u32 = 64u;
var<workgroup> partial: array<vec3f, THREADS>;

fn belongs_to_a_light(direction: vec3f) -> bool {
    for (var i = 0u; i < arrayLength(&cones); i++) {
        if dot(cones[i].xyz, direction) > cones[i].w {
            return true;
        }
    }
    return false;
}

/// Irradiance by the sky around a direction.
fn irradiance_of(cell: u32) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = ranges[cell].x; i < ranges[cell].y; i++) {
        let place = patches[i];
        if place.w > 0.0 && !belongs_to_a_light(place.xyz) {
            // The frame of a cube is left-handed.
            let direction = sky.map_from_receiver * place.xyz * vec3f(1.0, 1.0, -1.0);
            sum += place.w * max(sample_faces(faces, direction, sky.level).rgb, vec3f(0.0));
        }
    }
    return sum;
}

/// One workgroup.
@compute @workgroup_size(THREADS)
fn weigh_sky(@builtin(local_invocation_index) thread: u32) {
    var own = vec3f(0.0);
    for (var cell = thread; cell < sky.count; cell += THREADS) {
        let irradiance = irradiance_of(cell);
        views[sky.first_view + cell].weight = irradiance;
        own += irradiance;
    }
    partial[thread] = own;
    for (var stride = THREADS / 2u; stride > 0u; stride /= 2u) {
        workgroupBarrier();
        if thread < stride {
            partial[thread] += partial[thread + stride];
        }
    }
    workgroupBarrier();
    let all_light = partial[0];
    // A color that is missing has no shadows that would show; its weights must be finite all the same.
    let even = vec3f(1.0 / f32(sky.count));
    for (var cell = thread; cell < sky.count; cell += THREADS) {
        let view = sky.first_view + cell;
        views[view].weight = select(views[view].weight / max(all_light, vec3f(1e-9)), even, all_light < vec3f(1e-6));
    }
}
