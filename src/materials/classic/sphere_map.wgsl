// Light of a sphere map, which `sphere_map.rs` cuts out of the camera frame, in frame buffer units.

#define_import_path bevy_mirrorball::materials::classic::sphere_map

#import bevy_pbr::mesh_view_bindings::view
#import bevy_mirrorball::materials::strongest_light::strongest_light

/// Edge lengths of the maps in texels.
const MIRROR_EDGE: i32 = 32;
const DIFFUSE_EDGE: i32 = 16;
/// Smallest squared length of a direction that counts; keeps divisors above zero.
const MIN_SQUARED_LENGTH: f32 = 1e-12;

/// Place of a normal in a map: to the right and up as seen, −1…1.
fn place_in_map(normal: vec3f, dir_view: vec3f) -> vec2f {
    let across = cross(view.world_from_view[1].xyz, dir_view);
    let right = across * inverseSqrt(max(dot(across, across), MIN_SQUARED_LENGTH));
    return vec2f(dot(normal, right), dot(normal, cross(dir_view, right)));
}

/// Texel coordinates of a place, rows from the top.
fn texel_at(place: vec2f, edge: i32) -> vec2f {
    let last = f32(edge - 1);
    return clamp((vec2f(place.x, -place.y) * 0.5 + 0.5) * f32(edge) - 0.5, vec2f(0.0), vec2f(last));
}

fn mirror_texel(texel: vec2i) -> vec3f {
    let inside = min(texel, vec2i(MIRROR_EDGE - 1));
    return strongest_light.mirror_map[inside.y * MIRROR_EDGE + inside.x].rgb;
}

fn diffuse_texel(texel: vec2i) -> vec3f {
    let inside = min(texel, vec2i(DIFFUSE_EDGE - 1));
    return strongest_light.diffuse_map[inside.y * DIFFUSE_EDGE + inside.x].rgb;
}

/// Radiance that a mirror shows: that of the ball at the same normal.
fn sphere_radiance(normal: vec3f, dir_view: vec3f) -> vec3f {
    let at = texel_at(place_in_map(normal, dir_view), MIRROR_EDGE);
    let low = vec2i(at);
    let t = at - vec2f(low);
    let upper = mix(mirror_texel(low), mirror_texel(low + vec2i(1, 0)), t.x);
    let lower = mix(mirror_texel(low + vec2i(0, 1)), mirror_texel(low + vec2i(1, 1)), t.x);
    return mix(upper, lower, t.y);
}

/// What white paper shows: the ball mirrors the direction of a normal where its own is halfway to the view.
fn sphere_irradiance(normal: vec3f, dir_view: vec3f) -> vec3f {
    let between = normal + dir_view;
    let halfway = between * inverseSqrt(max(dot(between, between), MIN_SQUARED_LENGTH));
    let at = texel_at(place_in_map(halfway, dir_view), DIFFUSE_EDGE);
    let low = vec2i(at);
    let t = at - vec2f(low);
    let upper = mix(diffuse_texel(low), diffuse_texel(low + vec2i(1, 0)), t.x);
    let lower = mix(diffuse_texel(low + vec2i(0, 1)), diffuse_texel(low + vec2i(1, 1)), t.x);
    return mix(upper, lower, t.y);
}
