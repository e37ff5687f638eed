// Light that surfels send to a point. The formulas are in shadows/mod.rs.

#define_import_path bevy_mirrorball::shadows::render::surfels

#import bevy_mirrorball::shadows::render::bindings::results
#import bevy_mirrorball::shadows::render::dome::{LitSurfel, unpack_radiance}

const PI: f32 = 3.14159265;

/// Projected solid angle of a disc of an area at an offset, as seen from a surface: that of a small disc, which cannot
/// exceed a hemisphere when it is close (Bunnell 2005, *Dynamic Ambient Occlusion and Indirect Lighting*).
fn projected_solid_angle(offset: vec3f, normal: vec3f, area: f32, disc_normal: vec3f) -> f32 {
    let squared = max(dot(offset, offset), 1e-12);
    let cosines = max(dot(normal, offset), 0.0) * max(-dot(disc_normal, offset), 0.0);
    return area * cosines / (squared * (squared + area / PI));
}

/// Irradiance from surfels.
struct BouncedLight {
    /// As it is. At a real surface, only what is not there without virtual things, and `real`.
    now: vec3f,
    /// Without virtual things, at a real surface.
    real: vec3f,
}

/// Irradiance from a surfel. At a virtual surface, surfels below the horizon hide the environment's radiance there.
fn light_from(surfel: LitSurfel, hidden: vec3f, pos_world: vec3f, normal: vec3f, is_real: bool) -> BouncedLight {
    let solid_angle = projected_solid_angle(surfel.pos_world - pos_world, normal, surfel.area, surfel.normal);
    let radiance = unpack_radiance(surfel.radiance, surfel.last);
    let real = select(vec3f(0.0), radiance.real, is_real);
    let now = select(radiance.to_virtual - hidden, radiance.to_real + real, is_real);
    return BouncedLight(now * solid_angle, real * solid_angle);
}

/// Radiance that a surfel at an offset hides from a virtual surface.
fn hidden_by(offset: vec3f, up: vec3f, below_horizon: vec3f) -> vec3f {
    return select(vec3f(0.0), below_horizon, dot(offset, up) < 0.0);
}

fn add_bounced(a: BouncedLight, b: BouncedLight) -> BouncedLight {
    return BouncedLight(a.now + b.now, a.real + b.real);
}

fn light_of_surfel(i: u32, pos_world: vec3f, normal: vec3f, is_real: bool) -> BouncedLight {
    let surfel = results.lit.surfels[i];
    let hidden = hidden_by(surfel.pos_world - pos_world, results.lit.up, results.lit.hidden);
    return light_from(surfel, hidden, pos_world, normal, is_real);
}

/// Irradiance from all surfels at a surface.
fn bounced_light(pos_world: vec3f, normal: vec3f, is_real: bool) -> BouncedLight {
    var sum = BouncedLight();
    for (var i = 0u; i < results.lit.count; i++) {
        sum = add_bounced(sum, light_of_surfel(i, pos_world, normal, is_real));
    }
    return sum;
}
