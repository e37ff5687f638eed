// Light of virtual lamps on surfaces, and what it is relative to the light that falls on them in the real room.

#define_import_path bevy_mirrorball::materials::lamps

#import bevy_pbr::{
    clustered_forward as clustering,
    lighting::getDistanceAttenuation,
    mesh_types::MESH_FLAGS_SHADOW_RECEIVER_BIT,
    mesh_view_bindings as view_bindings,
    mesh_view_types::{
        DIRECTIONAL_LIGHT_FLAGS_SHADOWS_ENABLED_BIT,
        POINT_LIGHT_FLAGS_SHADOWS_ENABLED_BIT,
        POINT_LIGHT_FLAGS_SPOT_LIGHT_Y_NEGATIVE,
    },
    shadows,
}
#import bevy_render::maths::PI
#import bevy_mirrorball::luminance::luminance
#ifdef ENVIRONMENT_MAP
#import bevy_pbr::environment_map::compute_radiances
#import bevy_pbr::lighting::LayerLightingInput
#endif

/// Lower bound of real irradiance ÷ π, in camera units: a black frame holds no information about the surface color.
const MIN_REAL_IRRADIANCE: f32 = 1e-3;
/// Irradiance ÷ π of the map, in camera units, up to which in all channels it counts as not yet measured.
const MIN_MEASURED_IRRADIANCE: f32 = 1e-5;

/// Point on a surface, and the flags of its mesh.
struct LitSurface {
    frag_coord: vec4f,
    pos_world: vec4f,
    /// Normal that is shaded, with its normal map.
    normal: vec3f,
    /// Normal of the mesh.
    normal_mesh: vec3f,
    flags: u32,
}

/// One lamp, as a surface sees it.
struct Lamp {
    /// Towards the lamp.
    dir: vec3f,
    /// Irradiance of a surface that faces it, without shadows, in Bevy's units before exposure.
    irradiance: vec3f,
}

/// Light of all lamps at a surface.
struct LampLight {
    /// Irradiance, shadowed by the engine's shadow maps, in Bevy's units before exposure.
    arriving: vec3f,
    /// The same without shadows.
    open: vec3f,
    /// Light vector without shadows, in luminance: irradiance at n minus irradiance at −n is n · (light vector).
    vector: vec3f,
}

/// Attenuation by the cone of a spot light towards a surface in direction −`dir`, 0…1.
fn spot_attenuation(id: u32, dir: vec3f) -> f32 {
    let lamp = &view_bindings::clustered_lights.data[id];
    let across = (*lamp).light_custom_data.xy;
    let up = sqrt(max(0.0, 1.0 - dot(across, across)));
    let is_down = ((*lamp).flags & POINT_LIGHT_FLAGS_SPOT_LIGHT_Y_NEGATIVE) != 0u;
    let axis = vec3f(across.x, select(up, -up, is_down), across.y);
    let attenuation = saturate(dot(-axis, dir) * (*lamp).light_custom_data.z + (*lamp).light_custom_data.w);
    return attenuation * attenuation;
}

/// One clustered point or spot light.
fn clustered_lamp(surface: LitSurface, id: u32, is_spot: bool) -> Lamp {
    let lamp = &view_bindings::clustered_lights.data[id];
    let towards = (*lamp).position_radius.xyz - surface.pos_world.xyz;
    let distance_squared = dot(towards, towards);
    let dir = towards * inverseSqrt(max(distance_squared, 1e-12));
    var falloff = getDistanceAttenuation(distance_squared, (*lamp).color_inverse_square_range.w);
    if is_spot {
        falloff *= spot_attenuation(id, dir);
    }
    return Lamp(dir, (*lamp).color_inverse_square_range.rgb * falloff);
}

fn directional_lamp(i: u32) -> Lamp {
    let lamp = &view_bindings::lights.directional_lights[i];
    return Lamp((*lamp).direction_to_light, (*lamp).color.rgb);
}

/// Fraction of the light of a clustered lamp that its shadow map lets through.
fn clustered_shadow(surface: LitSurface, id: u32, is_spot: bool) -> f32 {
    let lamp = &view_bindings::clustered_lights.data[id];
    let receives = (surface.flags & MESH_FLAGS_SHADOW_RECEIVER_BIT) != 0u;
    if !receives || ((*lamp).flags & POINT_LIGHT_FLAGS_SHADOWS_ENABLED_BIT) == 0u {
        return 1.0;
    }
    let xy = surface.frag_coord.xy;
    if is_spot {
        return shadows::fetch_spot_shadow(id, surface.pos_world, surface.normal_mesh, (*lamp).shadow_map_near_z, xy);
    }
    return shadows::fetch_point_shadow(id, surface.pos_world, surface.normal_mesh, xy);
}

/// Fraction of the light of a directional lamp that its shadow maps let through.
fn directional_shadow(surface: LitSurface, i: u32, view_z: f32) -> f32 {
    let lamp = &view_bindings::lights.directional_lights[i];
    let receives = (surface.flags & MESH_FLAGS_SHADOW_RECEIVER_BIT) != 0u;
    if !receives || ((*lamp).flags & DIRECTIONAL_LIGHT_FLAGS_SHADOWS_ENABLED_BIT) == 0u {
        return 1.0;
    }
    let xy = surface.frag_coord.xy;
    return shadows::fetch_directional_shadow(i, surface.pos_world, surface.normal_mesh, view_z, xy);
}

fn view_depth(surface: LitSurface) -> f32 {
    return (view_bindings::view.view_from_world * surface.pos_world).z;
}

/// Cluster of a surface: the ranges of its lamps in the list of all clusters.
fn cluster_of(surface: LitSurface) -> clustering::ClusterableObjectIndexRanges {
    let is_orthographic = view_bindings::view.clip_from_view[3].w == 1.0;
    let cluster =
        clustering::view_fragment_cluster_index(surface.frag_coord.xy, view_depth(surface), is_orthographic);
    return clustering::unpack_clusterable_object_index_ranges(cluster);
}

/// Adds one lamp to the light of all. The shadow is a fraction that arrives.
fn with_lamp(light: LampLight, lamp: Lamp, normal: vec3f, shadow: f32) -> LampLight {
    let open = lamp.irradiance * saturate(dot(normal, lamp.dir));
    let vector = luminance(lamp.irradiance) * lamp.dir;
    return LampLight(light.arriving + open * shadow, light.open + open, light.vector + vector);
}

/// Light of all lamps.
fn lamp_light(surface: LitSurface) -> LampLight {
    let ranges = cluster_of(surface);
    var light = LampLight(vec3f(0.0), vec3f(0.0), vec3f(0.0));
    for (var i = ranges.first_point_light_index_offset; i < ranges.first_reflection_probe_index_offset; i++) {
        let id = clustering::get_clusterable_object_id(i);
        let is_spot = i >= ranges.first_spot_light_index_offset;
        let shadow = clustered_shadow(surface, id, is_spot);
        light = with_lamp(light, clustered_lamp(surface, id, is_spot), surface.normal, shadow);
    }
    let view_z = view_depth(surface);
    for (var i = 0u; i < view_bindings::lights.n_directional_lights; i++) {
        light = with_lamp(light, directional_lamp(i), surface.normal, directional_shadow(surface, i, view_z));
    }
    return light;
}

/// Irradiance from all lamps on both sides of a sheet with this normal, without shadows, in Bevy's units before
/// exposure: the side that faces along the normal, and the other.
fn lamp_irradiance_on_sides(surface: LitSurface, normal: vec3f) -> array<vec3f, 2> {
    let ranges = cluster_of(surface);
    var sides = array(vec3f(0.0), vec3f(0.0));
    for (var i = ranges.first_point_light_index_offset; i < ranges.first_reflection_probe_index_offset; i++) {
        let id = clustering::get_clusterable_object_id(i);
        let lamp = clustered_lamp(surface, id, i >= ranges.first_spot_light_index_offset);
        let cosine = dot(normal, lamp.dir);
        sides[0] += lamp.irradiance * saturate(cosine);
        sides[1] += lamp.irradiance * saturate(-cosine);
    }
    for (var i = 0u; i < view_bindings::lights.n_directional_lights; i++) {
        let lamp = directional_lamp(i);
        let cosine = dot(normal, lamp.dir);
        sides[0] += lamp.irradiance * saturate(cosine);
        sides[1] += lamp.irradiance * saturate(-cosine);
    }
    return sides;
}

/// Irradiance from the lamps ÷ irradiance in the real room: the factor by which lamps brighten the camera frame. 0
/// without an environment map or with a black one, because the light of the room is then unknown. `fraction_left` is
/// the fraction of the real light that phantoms do not block.
fn lamp_gain(surface: LitSurface, fraction_left: f32) -> vec3f {
#ifdef ENVIRONMENT_MAP
    let lamps = lamp_light(surface).arriving;
    if all(lamps <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    var layer: LayerLightingInput;
    layer.N = surface.normal;
    layer.R = surface.normal;
    layer.NdotV = 1.0;
    layer.perceptual_roughness = 1.0;
    layer.roughness = 1.0;
    var ranges = cluster_of(surface);
    let open = compute_radiances(layer, &ranges, surface.pos_world.xyz, false).irradiance;
    let exposure = view_bindings::view.exposure;
    if all(open * exposure <= vec3f(MIN_MEASURED_IRRADIANCE)) {
        return vec3f(0.0);
    }
    let real = open * fraction_left * exposure;
    return lamps * (exposure / PI) / max(real, vec3f(MIN_REAL_IRRADIANCE));
#else
    return vec3f(0.0);
#endif
}
