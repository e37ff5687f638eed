// Light of a sphere map, which `sphere_map.rs` cuts out of the camera frame, in frame buffer units.

#define_import_path bevy_mirrorball::materials::classic::sphere_map

#import bevy_pbr::mesh_view_bindings::view
#import bevy_mirrorball::materials::strongest_light::strongest_light

/// A map among the texels of both.
struct Map {
    first: i32,
    /// Edge length in texels.
    edge: i32,
}

const MIRROR: Map = Map(0, 32);
const DIFFUSE: Map = Map(1024, 16);
/// Smallest squared length of a direction that counts; keeps divisors above zero.
const MIN_SQUARED_LENGTH: f32 = 1e-12;

/// Place of a normal in a map: to the right and up as seen, −1…1.
fn place_in_map(normal: vec3f, dir_view: vec3f) -> vec2f {
    let across = cross(view.world_from_view[1].xyz, dir_view);
    let right = across * inverseSqrt(max(dot(across, across), MIN_SQUARED_LENGTH));
    return vec2f(dot(normal, right), dot(normal, cross(dir_view, right)));
}

fn texel(map: Map, at: vec2i) -> vec3f {
    let inside = min(at, vec2i(map.edge - 1));
    return strongest_light.sphere_map[map.first + inside.y * map.edge + inside.x].rgb;
}

/// Light at a place of a map, interpolated. Its rows start at the top.
fn light_at(map: Map, place: vec2f) -> vec3f {
    let texels = (vec2f(place.x, -place.y) * 0.5 + 0.5) * f32(map.edge) - 0.5;
    let at = clamp(texels, vec2f(0.0), vec2f(f32(map.edge - 1)));
    let low = vec2i(at);
    let t = at - vec2f(low);
    let upper = mix(texel(map, low), texel(map, low + vec2i(1, 0)), t.x);
    let lower = mix(texel(map, low + vec2i(0, 1)), texel(map, low + vec2i(1, 1)), t.x);
    return mix(upper, lower, t.y);
}

/// Radiance that a mirror shows: that of the ball at the same normal.
fn sphere_radiance(normal: vec3f, dir_view: vec3f) -> vec3f {
    return light_at(MIRROR, place_in_map(normal, dir_view));
}

/// What white paper shows: the ball mirrors the direction of a normal where its own is halfway to the view.
fn sphere_irradiance(normal: vec3f, dir_view: vec3f) -> vec3f {
    let between = normal + dir_view;
    let halfway = between * inverseSqrt(max(dot(between, between), MIN_SQUARED_LENGTH));
    return light_at(DIFFUSE, place_in_map(halfway, dir_view));
}
