// Surfels → the light that they send: first the light of the dome that arrives at them, then the albedo of each
// phantom, from what the camera sees of it, then their radiance. Once more with the light that they send to each other.
//
// Definitions: those of maps.wgsl and visibility.wgsl.

#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::shadows::render::bindings::dome
#import bevy_mirrorball::shadows::render::dome::{LitSurfel, LitSurfels, SurfelRadiance, pack_radiance}
#import bevy_mirrorball::shadows::render::surfels::{PI, hidden_by, light_from}
#import bevy_mirrorball::shadows::render::visibility::{
    IncomingLight, bright_directions, direction_at, direction_visibility, hidden_radiance, incoming_key_light,
    incoming_light, is_key, key_light_visibility, surface_term,
}

/// Mirror of `Surfel` in `bounce/mod.rs`.
struct Surfel {
    pos_world: vec3f,
    area: f32,
    normal: vec3f,
    flags: u32,
    color: vec3f,
}

/// Mirror of `SurfelsUniform` in `surfel_pipeline.rs`.
struct Surfels {
    up: vec3f,
    count: u32,
    covers_phantoms: u32,
    /// 1 if the dome has shadow maps above the horizon only.
    has_horizon: u32,
}

/// Irradiance of a surfel, as it is and as it would be without virtual things.
struct Arriving {
    now: vec3f,
    real: vec3f,
}

@group(0) @binding(0) var<uniform> uniforms: Surfels;
@group(0) @binding(1) var<storage, read> surfels: array<Surfel>;
@group(0) @binding(2) var<storage, read_write> arriving: array<Arriving>;
/// Per phantom.
@group(0) @binding(3) var<storage, read_write> albedos: array<vec4f>;
@group(0) @binding(4) var<storage, read_write> lit: LitSurfels;

/// Twins of the constants in `bounce/mod.rs`.
const IS_VIRTUAL: u32 = 1u;
const IS_VISIBLE: u32 = 2u;
const PHANTOM_SHIFT: u32 = 8u;
const MAX_PHANTOMS: u32 = 64u;
const THREADS: u32 = 64u;
/// Minimum irradiance that counts, in linear camera units.
const MIN_IRRADIANCE: f32 = 1e-4;

fn with_light(sums: Arriving, incoming: IncomingLight, past: vec2f, hidden: vec3f) -> Arriving {
    let now = surface_term(incoming.light, past, hidden).shadowed;
    let real = surface_term(incoming.light, vec2f(past.x, 1.0), hidden).shadowed;
    return Arriving(sums.now + now, sums.real + real);
}

/// One thread per surfel: light of the dome at it.
@compute @workgroup_size(THREADS)
fn receive(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= uniforms.count {
        return;
    }
    let surfel = surfels[id.x];
    let is_real = (surfel.flags & IS_VIRTUAL) == 0u;
    let hidden = select(hidden_radiance(), vec3f(0.0), uniforms.covers_phantoms != 0u);
    let bright = bright_directions();
    var sums = Arriving();
    for (var rank = 0u; rank < dome.direction_count; rank++) {
        let index = direction_at(rank);
        if is_key(index) {
            continue;
        }
        let incoming = incoming_light(index, surfel.pos_world, surfel.normal);
        var past = vec2f(1.0);
        if rank < bright {
            past = direction_visibility(incoming, surfel.normal, is_real);
        }
        sums = with_light(sums, incoming, past, hidden);
    }
#ifdef KEY_LIGHTS
    for (var key = dome.first_key; key < dome.shadow_map_count; key++) {
        let incoming = incoming_key_light(key, surfel.pos_world, surfel.normal);
        let past = key_light_visibility(incoming, surfel.normal, is_real);
        sums = with_light(sums, incoming, past, hidden);
    }
#endif
    arriving[id.x] = sums;
}

/// One thread per surfel: light of the other surfels at it.
@compute @workgroup_size(THREADS)
fn receive_bounced(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= uniforms.count {
        return;
    }
    let surfel = surfels[id.x];
    let is_real = (surfel.flags & IS_VIRTUAL) == 0u;
    var sums = arriving[id.x];
    for (var i = 0u; i < uniforms.count; i++) {
        let other = lit.surfels[i];
        let hidden = hidden_by(other.pos_world - surfel.pos_world, lit.up, lit.hidden);
        let light = light_from(other, hidden, surfel.pos_world, surfel.normal, is_real);
        sums = Arriving(sums.now + light.now, sums.real + light.real);
    }
    arriving[id.x] = Arriving(max(sums.now, vec3f(0.0)), max(sums.real, vec3f(0.0)));
}

var<workgroup> radiances: array<vec3f, THREADS>;
var<workgroup> irradiances: array<vec3f, THREADS>;

/// One workgroup per phantom: its albedo from the light that arrives where the camera sees it.
@compute @workgroup_size(THREADS)
fn estimate_albedo(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) thread: u32) {
    var radiance = vec3f(0.0);
    var irradiance = vec3f(0.0);
    for (var i = thread; i < uniforms.count; i += THREADS) {
        let flags = surfels[i].flags;
        if (flags & IS_VISIBLE) != 0u && (flags >> PHANTOM_SHIFT) == group.x {
            radiance += surfels[i].color * surfels[i].area;
            irradiance += arriving[i].real * surfels[i].area;
        }
    }
    radiances[thread] = radiance;
    irradiances[thread] = irradiance;
    for (var stride = THREADS / 2u; stride > 0u; stride /= 2u) {
        workgroupBarrier();
        if thread < stride {
            radiances[thread] += radiances[thread + stride];
            irradiances[thread] += irradiances[thread + stride];
        }
    }
    workgroupBarrier();
    if thread == 0u {
        albedos[group.x] = vec4f(saturate(PI * radiances[0] / max(irradiances[0], vec3f(1e-6))), 0.0);
    }
}

/// Radiance of a surfel, as it is (x) and as it would be without virtual things (y).
fn radiance_of(i: u32) -> array<vec3f, 2> {
    let surfel = surfels[i];
    let sums = arriving[i];
    if (surfel.flags & IS_VIRTUAL) != 0u {
        return array<vec3f, 2>(surfel.color * sums.now / PI, vec3f(0.0));
    }
    if (surfel.flags & IS_VISIBLE) != 0u && luminance(sums.real) > MIN_IRRADIANCE {
        let left = clamp(sums.now / max(sums.real, vec3f(1e-6)), vec3f(0.0), vec3f(1.0));
        return array<vec3f, 2>(surfel.color * left, surfel.color);
    }
    let albedo = albedos[min(surfel.flags >> PHANTOM_SHIFT, MAX_PHANTOMS - 1u)].rgb;
    return array<vec3f, 2>(albedo * sums.now / PI, albedo * sums.real / PI);
}

/// One thread per surfel: the light that it sends.
@compute @workgroup_size(THREADS)
fn send(@builtin(global_invocation_id) id: vec3u) {
    if id.x == 0u {
        lit.up = uniforms.up;
        lit.count = uniforms.count;
        lit.hidden = hidden_radiance() * f32(uniforms.has_horizon);
        lit.covers_phantoms = uniforms.covers_phantoms;
    }
    if id.x >= uniforms.count {
        return;
    }
    let surfel = surfels[id.x];
    let radiance = radiance_of(id.x);
    let packed = pack_radiance(SurfelRadiance(radiance[0], radiance[0] - radiance[1], radiance[1]));
    lit.surfels[id.x] = LitSurfel(
        surfel.pos_world, surfel.area, surfel.normal, packed[4], vec4u(packed[0], packed[1], packed[2], packed[3]),
    );
}
