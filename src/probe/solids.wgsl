// Solids: boxes around real objects, which hide a ball from the camera or stand where the ball cannot show them. Twin
// of solids.rs.

#define_import_path bevy_mirrorball::probe::solids

/// Rows of the map from camera space to the cube −1…1. Mirror of `SolidUniform` in `solids.rs`.
struct Solid {
    x: vec4f,
    y: vec4f,
    z: vec4f,
}

/// Lower bound of the components of a direction used as divisors.
const PARALLEL_EPSILON: f32 = 1e-9;

/// Interval of a ray inside a box that is scaled by a factor per axis: start and end, in lengths of `dir`; end <
/// start if the ray misses the box.
fn inside_of(solid: Solid, grown: vec3f, origin: vec3f, dir: vec3f) -> vec2f {
    let place = vec4f(origin, 1.0);
    let start = vec3f(dot(solid.x, place), dot(solid.y, place), dot(solid.z, place));
    let raw = vec3f(dot(solid.x.xyz, dir), dot(solid.y.xyz, dir), dot(solid.z.xyz, dir));
    let along = select(raw, vec3f(PARALLEL_EPSILON), abs(raw) < vec3f(PARALLEL_EPSILON));
    let a = (-grown - start) / along;
    let b = (grown - start) / along;
    let enter = min(a, b);
    let leave = max(a, b);
    return vec2f(max(enter.x, max(enter.y, enter.z)), min(leave.x, min(leave.y, leave.z)));
}

/// Fraction of the view from the camera (the origin) to a point that a box hides, 0…1. It falls off over `margin`
/// meters beside the box.
fn hidden_share(solid: Solid, margin: f32, point: vec3f) -> f32 {
    let scale = vec3f(length(solid.x.xyz), length(solid.y.xyz), length(solid.z.xyz));
    let span = inside_of(solid, vec3f(1.0) + margin * scale, vec3f(0.0), point);
    let chord = (min(span.y, 1.0) - max(span.x, 0.0)) * length(point);
    return clamp(chord / (2.0 * margin), 0.0, 1.0);
}
