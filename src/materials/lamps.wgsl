// Illumination of real surfaces by virtual lamps, relative to the light that falls on the surface in the real room.

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
#ifdef ENVIRONMENT_MAP
#import bevy_pbr::environment_map::compute_radiances
#import bevy_pbr::lighting::LayerLightingInput
#endif

/// Lower bound of real irradiance ÷ π, in camera units: a black frame holds no information about the surface color.
const MIN_REAL_IRRADIANCE: f32 = 1e-3;
/// Irradiance ÷ π of the map, in camera units, up to which in all channels it counts as not yet measured.
const MIN_MEASURED_IRRADIANCE: f32 = 1e-5;

/// Point on a real surface, and the flags of its mesh.
struct RealSurface {
    frag_coord: vec4f,
    pos_world: vec4f,
    normal: vec3f,
    flags: u32,
}

/// Irradiance from one clustered point or spot light, without shadow and spot cone, in Bevy's units before exposure.
fn clustered_lamp_irradiance(surface: RealSurface, id: u32) -> vec3f {
    let lamp = &view_bindings::clustered_lights.data[id];
    let towards = (*lamp).position_radius.xyz - surface.pos_world.xyz;
    let distance_squared = dot(towards, towards);
    let cos_angle = saturate(dot(surface.normal, towards) * inverseSqrt(max(distance_squared, 1e-12)));
    let falloff = getDistanceAttenuation(distance_squared, (*lamp).color_inverse_square_range.w);
    return (*lamp).color_inverse_square_range.rgb * (falloff * cos_angle);
}

/// Attenuation by the cone of a spot light towards the surface, 0…1.
fn spot_attenuation(surface: RealSurface, id: u32) -> f32 {
    let lamp = &view_bindings::clustered_lights.data[id];
    let across = (*lamp).light_custom_data.xy;
    let up = sqrt(max(0.0, 1.0 - dot(across, across)));
    let is_down = ((*lamp).flags & POINT_LIGHT_FLAGS_SPOT_LIGHT_Y_NEGATIVE) != 0u;
    let dir = vec3f(across.x, select(up, -up, is_down), across.y);
    let towards = normalize((*lamp).position_radius.xyz - surface.pos_world.xyz);
    let attenuation = saturate(dot(-dir, towards) * (*lamp).light_custom_data.z + (*lamp).light_custom_data.w);
    return attenuation * attenuation;
}

/// Irradiance from all lamps, shadowed by the engine's shadow maps, in Bevy's units before exposure.
fn lamp_irradiance(surface: RealSurface) -> vec3f {
    let pos = surface.pos_world;
    let xy = surface.frag_coord.xy;
    let view_z = (view_bindings::view.view_from_world * pos).z;
    let is_orthographic = view_bindings::view.clip_from_view[3].w == 1.0;
    let cluster = clustering::view_fragment_cluster_index(xy, view_z, is_orthographic);
    let ranges = clustering::unpack_clusterable_object_index_ranges(cluster);
    let receives = (surface.flags & MESH_FLAGS_SHADOW_RECEIVER_BIT) != 0u;
    var sum = vec3f(0.0);
    for (var i = ranges.first_point_light_index_offset; i < ranges.first_spot_light_index_offset; i++) {
        let id = clustering::get_clusterable_object_id(i);
        var light = clustered_lamp_irradiance(surface, id);
        if receives && (view_bindings::clustered_lights.data[id].flags & POINT_LIGHT_FLAGS_SHADOWS_ENABLED_BIT) != 0u {
            light *= shadows::fetch_point_shadow(id, pos, surface.normal, xy);
        }
        sum += light;
    }
    for (var i = ranges.first_spot_light_index_offset; i < ranges.first_reflection_probe_index_offset; i++) {
        let id = clustering::get_clusterable_object_id(i);
        var light = clustered_lamp_irradiance(surface, id) * spot_attenuation(surface, id);
        let near_z = view_bindings::clustered_lights.data[id].shadow_map_near_z;
        if receives && (view_bindings::clustered_lights.data[id].flags & POINT_LIGHT_FLAGS_SHADOWS_ENABLED_BIT) != 0u {
            light *= shadows::fetch_spot_shadow(id, pos, surface.normal, near_z, xy);
        }
        sum += light;
    }
    for (var i = 0u; i < view_bindings::lights.n_directional_lights; i++) {
        let lamp = &view_bindings::lights.directional_lights[i];
        var light = (*lamp).color.rgb * saturate(dot(surface.normal, (*lamp).direction_to_light));
        if receives && ((*lamp).flags & DIRECTIONAL_LIGHT_FLAGS_SHADOWS_ENABLED_BIT) != 0u {
            light *= shadows::fetch_directional_shadow(i, pos, surface.normal, view_z, xy);
        }
        sum += light;
    }
    return sum;
}

/// Irradiance from the lamps ÷ irradiance in the real room: the factor by which lamps brighten the camera frame. 0
/// without an environment map or with a black one, because the light of the room is then unknown. `fraction_left` is
/// the fraction of the real light that phantoms do not block.
fn lamp_gain(surface: RealSurface, fraction_left: f32) -> vec3f {
#ifdef ENVIRONMENT_MAP
    let lamps = lamp_irradiance(surface);
    if all(lamps <= vec3f(0.0)) {
        return vec3f(0.0);
    }
    var layer: LayerLightingInput;
    layer.N = surface.normal;
    layer.R = surface.normal;
    layer.NdotV = 1.0;
    layer.perceptual_roughness = 1.0;
    layer.roughness = 1.0;
    let view_z = (view_bindings::view.view_from_world * surface.pos_world).z;
    let is_orthographic = view_bindings::view.clip_from_view[3].w == 1.0;
    let cluster = clustering::view_fragment_cluster_index(surface.frag_coord.xy, view_z, is_orthographic);
    var ranges = clustering::unpack_clusterable_object_index_ranges(cluster);
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
