// Light of the room as a toon surface shows it: what arrives, and the brightest and the darkest light at its place.
//
// Definitions: HAS_LAMPS: there are lamps of the engine.

#define_import_path bevy_mirrorball::materials::toon::room_light

#import bevy_pbr::{
    ambient::ambient_light,
    forward_io::VertexOutput,
    mesh_types::MESH_FLAGS_SHADOW_RECEIVER_BIT,
    mesh_view_bindings::view,
    pbr_types::PbrInput,
}
#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::materials::toon::key_light::key_light
#import bevy_mirrorball::materials::toon::toon_bindings::toon
#import bevy_mirrorball::materials::view_environment::{view_irradiance, view_light_vector}
#import bevy_mirrorball::shadows::render::receive::virtual_ratio
#ifdef HAS_LAMPS
#import bevy_render::maths::PI
#import bevy_mirrorball::materials::lamps::{LitSurface, lamp_irradiance_on_sides, lamp_light}
#endif

/// Smallest length of a light vector that has a direction, in frame buffer units.
const MIN_VECTOR: f32 = 1e-6;

/// Smallest fraction of a surface's light for which shadows are taken to be those of the key light.
const MIN_KEY_FRACTION: f32 = 0.3;

/// Light at a surface: what white paper there shows, in frame buffer units.
struct RoomLight {
    /// Under all shadows, and without any.
    arriving: vec3f,
    open: vec3f,
    /// Towards the key light, and paper that faces it or turns its back on it, both without shadows.
    dir_bright: vec3f,
    bright: vec3f,
    opposite: vec3f,
    /// 1 if a key light was chosen, 0 if the light that prevails is the key light.
    key_weight: f32,
    /// N·L of the light that prevails, and of the chosen one, at least 0.
    prevailing_cosine: f32,
    chosen_cosine: f32,
}

/// The engine's ambient light, which comes equally from everywhere.
fn ambient() -> vec3f {
    let up = vec3f(0.0, 1.0, 0.0);
    let white = vec3f(1.0);
    return ambient_light(vec4f(0.0), up, up, 1.0, white, vec3f(0.0), 1.0, white) * view.exposure;
}

/// Direction of a light vector, or the fallback if light comes equally from everywhere.
fn direction_or(vector: vec3f, fallback: vec3f) -> vec3f {
    let strength = length(vector);
    return select(fallback, vector / max(strength, MIN_VECTOR), strength > MIN_VECTOR);
}

/// Light on both sides of white paper with this normal, without shadows: the side that faces along the normal, and the
/// other.
fn light_on_sides(in: VertexOutput, normal: vec3f) -> array<vec3f, 2> {
    let everywhere = ambient();
    let measured = array(view_irradiance(normal), view_irradiance(-normal));
    var sides = array(measured[0] * toon.measured_light + everywhere, measured[1] * toon.measured_light + everywhere);
#ifdef HAS_LAMPS
    let lit = LitSurface(in.position, in.world_position, normal, normal, 0u);
    let lamps = lamp_irradiance_on_sides(lit, normal);
    sides[0] += lamps[0] * (view.exposure / PI);
    sides[1] += lamps[1] * (view.exposure / PI);
#endif
    return sides;
}

fn room_light(in: VertexOutput, surface: PbrInput) -> RoomLight {
    let is_receiver = (surface.flags & MESH_FLAGS_SHADOW_RECEIVER_BIT) != 0u;
    let ratio = virtual_ratio(in.position, in.world_position.xyz, surface.N);
    let left = surface.diffuse_occlusion * select(vec3f(1.0), ratio, is_receiver);

    var light: RoomLight;
    light.open = view_irradiance(surface.N) * toon.measured_light + ambient();
    light.arriving = light.open * left;
    var vector = view_light_vector() * toon.measured_light;
#ifdef HAS_LAMPS
    let lit = LitSurface(in.position, in.world_position, surface.N, in.world_normal, surface.flags);
    let lamps = lamp_light(lit);
    light.arriving += lamps.arriving * (view.exposure / PI);
    light.open += lamps.open * (view.exposure / PI);
    vector += lamps.vector * (view.exposure / PI);
#endif
    let key = key_light();
    light.key_weight = key.weight;
    let dir_prevailing = direction_or(vector, surface.N);
    light.prevailing_cosine = saturate(dot(surface.N, dir_prevailing));
    light.chosen_cosine = saturate(dot(surface.N, key.dir));
    light.dir_bright = direction_or(mix(dir_prevailing, key.dir, key.weight), surface.N);
    let sides = light_on_sides(in, light.dir_bright);
    light.bright = sides[0];
    light.opposite = sides[1];
    return light;
}

/// Fraction of the key light that shadows leave. A shadow takes the key light first: what the surface lacks of its
/// light counts as lacking from this one.
fn key_light_left(light: RoomLight, cosine: f32) -> f32 {
    let open = luminance(light.open);
    let lacking = select(0.0, 1.0 - luminance(light.arriving) / max(open, MIN_VECTOR), open > MIN_VECTOR);
    let fraction = luminance(light.bright - light.opposite) * cosine / max(open, MIN_VECTOR);
    return saturate(1.0 - lacking / clamp(fraction, MIN_KEY_FRACTION, 1.0));
}

/// N·L of the key light under its shadows. When a chosen light appears or vanishes, this changes steadily, wherever
/// light prevailed.
fn shadowed_cosine(light: RoomLight) -> f32 {
    let cosine = mix(light.prevailing_cosine, light.chosen_cosine, light.key_weight);
    return cosine * key_light_left(light, cosine);
}
