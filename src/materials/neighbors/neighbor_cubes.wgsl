// Cubes of what is around mirrors: radiance by level of roughness, and reciprocal distances. They are in a buffer
// because the textures of Bevy's materials and of this crate together would exceed WebGPU's limit of 16.

#define_import_path bevy_mirrorball::materials::neighbors::neighbor_cubes

#import bevy_mirrorball::environment_map::cubemap::place_of
#import bevy_mirrorball::materials::neighbors::cube_layout::{last_level, level_start, padded_edge}

/// Maximum number of mirrors. Twin of the constant in `neighbor_cubes.rs`.
const MAX_MIRRORS: u32 = 8u;

/// Mirror of `MirrorEntry` in `neighbor_cubes.rs`.
struct MirrorEntry {
    /// Center of the cube, in world space.
    center: vec3f,
    /// Index of its first texel.
    first_texel: u32,
    /// Half extents of the mesh around it, in meters.
    half_extents: vec3f,
    /// Edge length of its sharpest level in texels.
    edge: u32,
}

struct NeighborCubes {
    /// Number of mirrors.
    count: u32,
    mirrors: array<MirrorEntry, MAX_MIRRORS>,
    /// Radiance in frame buffer units, and reciprocal distance in 1/m: 16-bit floats.
    texels: array<vec2u>,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(105) var<storage, read> neighbors: NeighborCubes;

/// Distance in meters and fraction of the size that a surface may lie outside of the bounds of its mesh.
const MARGIN_METERS: f32 = 1e-4;
const MARGIN_FRACTION: f32 = 0.01;
/// Intervals of the ray that are searched, and steps of the secant method within the one in which it hits something.
const SEARCHED_INTERVALS: u32 = 4u;
const SECANT_STEPS: u32 = 2u;
/// Levels by which distances are more blurred than radiance.
const DISTANCE_BLUR: u32 = 1u;

/// Where a reflected ray meets the surroundings.
struct Hit {
    /// Direction from the center of the cube, of any length.
    dir_cube: vec3f,
    /// Distance from the surface ÷ distance from the center of the cube.
    distance_ratio: f32,
}

/// Index of the mirror to which a point of a surface belongs, or the number of mirrors.
fn mirror_at(pos_world: vec3f) -> u32 {
    for (var i = 0u; i < neighbors.count; i++) {
        let mirror = neighbors.mirrors[i];
        let reach = mirror.half_extents * (1.0 + MARGIN_FRACTION) + MARGIN_METERS;
        if all(abs(pos_world - mirror.center) <= reach) {
            return i;
        }
    }
    return neighbors.count;
}

fn texel(index: u32) -> vec4f {
    let stored = neighbors.texels[index];
    return vec4f(unpack2x16float(stored.x), unpack2x16float(stored.y));
}

/// Bilinear lookup in a level.
fn lookup(mirror: MirrorEntry, dir_cube: vec3f, level: u32) -> vec4f {
    let padded = padded_edge(mirror.edge, level);
    let place = place_of(dir_cube);
    let at = (place.position * 0.5 + 0.5) * f32(padded - 2u) + 0.5;
    let low = vec2u(at);
    let t = at - vec2f(low);
    let row = (place.face * padded + low.y) * padded + low.x;
    let first = mirror.first_texel + level_start(mirror.edge, level) + row;
    let upper = mix(texel(first), texel(first + 1u), t.x);
    let lower = mix(texel(first + padded), texel(first + padded + 1u), t.x);
    return mix(upper, lower, t.y);
}

/// How far a place on a reflected ray lies behind the surroundings, as seen from the center. `s` goes from 0 at the
/// surface to 1 infinitely far away; in front of planes the gap is linear in it. Twin of `gap` in
/// `near_reflections.rs`.
fn gap(mirror: MirrorEntry, level: u32, start: vec3f, dir: vec3f, distance: f32, s: f32) -> f32 {
    let along = mix(start, dir, s);
    return length(along) * distance * lookup(mirror, along, level).a - (1.0 - s);
}

/// Follows a ray from a place relative to the center of a cube to what it hits. Distances of a level that is as blurred
/// as the reflection blur silhouettes too. Twin of `hit` in `near_reflections.rs`.
fn hit(mirror: MirrorEntry, level: u32, place: vec3f, dir: vec3f) -> Hit {
    let distance = max(length(place), 1e-6);
    let start = place / distance;
    var before = vec2f(0.0, gap(mirror, level, start, dir, distance, 0.0));
    var after = before;
    for (var i = 1u; i <= SEARCHED_INTERVALS; i++) {
        if after.y >= 0.0 {
            break;
        }
        before = after;
        let s = f32(i) / f32(SEARCHED_INTERVALS);
        after = vec2f(s, gap(mirror, level, start, dir, distance, s));
    }
    for (var i = 0u; i < SECANT_STEPS; i++) {
        let s = crossing(before, after);
        let tried = vec2f(s, gap(mirror, level, start, dir, distance, s));
        if tried.y < 0.0 {
            before = tried;
        } else {
            after = tried;
        }
    }
    let s = crossing(before, after);
    let along = mix(start, dir, s);
    return Hit(along, s / max(length(along), 1e-6));
}

/// Zero of the line through two gaps.
fn crossing(before: vec2f, after: vec2f) -> f32 {
    let fraction = saturate(-before.y / max(after.y - before.y, 1e-6));
    return mix(before.x, after.x, fraction);
}

/// Radiance that a point of a mirror reflects from a direction in world space.
fn near_radiance(index: u32, pos_world: vec3f, dir_world: vec3f, perceptual_roughness: f32) -> vec3f {
    let mirror = neighbors.mirrors[index];
    // The frame of a cube is left-handed: its +z is the world's −Z.
    let cube_from_world = vec3f(1.0, 1.0, -1.0);
    let last = last_level(mirror.edge);
    let distances = min(u32(perceptual_roughness * f32(last)) + DISTANCE_BLUR, last);
    let place = (pos_world - mirror.center) * cube_from_world;
    let found = hit(mirror, distances, place, normalize(dir_world) * cube_from_world);
    // What is near is blurred less: the same lobe is narrower as seen from the center, which is farther away from it.
    let roughness = perceptual_roughness * sqrt(saturate(found.distance_ratio));
    let level = min(roughness, 1.0) * f32(last);
    let sharper = u32(level);
    let sharp = lookup(mirror, found.dir_cube, sharper).rgb;
    let rough = lookup(mirror, found.dir_cube, min(sharper + 1u, last)).rgb;
    return mix(sharp, rough, level - f32(sharper));
}
