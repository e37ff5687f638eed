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
#import bevy_mirrorball::materials::view_environment::{view_irradiance, view_light_vector}
#import bevy_mirrorball::shadows::render::receive::virtual_ratio
#ifdef HAS_LAMPS
#import bevy_render::maths::PI
#import bevy_mirrorball::materials::lamps::{LitSurface, lamp_irradiance_on_sides, lamp_light}
#endif

/// Smallest length of a light vector that has a direction, in frame buffer units.
const MIN_VECTOR: f32 = 1e-6;

/// Light at a surface: what white paper there shows, in frame buffer units.
struct RoomLight {
    /// Under all shadows.
    arriving: vec3f,
    /// Direction from which light prevails, and paper that faces it or turns its back on it, both without shadows.
    dir_bright: vec3f,
    bright: vec3f,
    opposite: vec3f,
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

fn room_light(in: VertexOutput, surface: PbrInput) -> RoomLight {
    let everywhere = ambient();
    let is_receiver = (surface.flags & MESH_FLAGS_SHADOW_RECEIVER_BIT) != 0u;
    let ratio = virtual_ratio(in.position, in.world_position.xyz, surface.N);
    let left = surface.diffuse_occlusion * select(vec3f(1.0), ratio, is_receiver);

    var light: RoomLight;
    light.arriving = (view_irradiance(surface.N) + everywhere) * left;
    var vector = view_light_vector();
#ifdef HAS_LAMPS
    let lit = LitSurface(in.position, in.world_position, surface.N, in.world_normal, surface.flags);
    let lamps = lamp_light(lit);
    light.arriving += lamps.arriving * (view.exposure / PI);
    vector += lamps.vector * (view.exposure / PI);
#endif
    light.dir_bright = direction_or(vector, surface.N);
    light.bright = view_irradiance(light.dir_bright) + everywhere;
    light.opposite = view_irradiance(-light.dir_bright) + everywhere;
#ifdef HAS_LAMPS
    let sides = lamp_irradiance_on_sides(lit, light.dir_bright);
    light.bright += sides[0] * (view.exposure / PI);
    light.opposite += sides[1] * (view.exposure / PI);
#endif
    return light;
}
