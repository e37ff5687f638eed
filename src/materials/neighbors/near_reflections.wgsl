// Reflections of neighbors in a surface, instead of those of the room that the engine has added.

#define_import_path bevy_mirrorball::materials::neighbors::near_reflections

#import bevy_mirrorball::materials::neighbors::neighbor_cubes::{mirror_at, near_radiance, neighbors}
#import bevy_pbr::{
    clustered_forward as clustering,
    lighting::{F_AB, F_Schlick, LayerLightingInput, perceptualRoughnessToRoughness},
    mesh_view_bindings::view,
    pbr_functions::calculate_F0,
    pbr_types::PbrInput,
}
#ifdef ENVIRONMENT_MAP
#import bevy_pbr::environment_map::{compute_radiances, radiance_sample_direction}
#endif

/// Minimum fraction of perpendicular light that a mirror reflects, and the perceptual roughness from which on a surface
/// is none. Twins of the constants in `mirror_bounds.rs`: what lies within the bounds of a mirror need not be one.
const MIN_REFLECTANCE: f32 = 0.1;
const MAX_ROUGHNESS: f32 = 0.6;
/// Fraction of perpendicular light below which no real material reflects; the engine fades reflections out there.
const FADING: f32 = 50.0 * 0.33;

/// What is to be added to a shaded surface, whose `room_radiance` is known. `occlusion` is that of the neighbors; that
/// of the room is the surface's.
fn near_reflection(surface: PbrInput, room: vec3f, occlusion: f32) -> vec3f {
#ifdef ENVIRONMENT_MAP
#ifndef SCREEN_SPACE_REFLECTIONS
#ifndef STANDARD_MATERIAL_ANISOTROPY
    let layer = base_layer(surface);
    let mirror = mirror_at(surface.world_position.xyz);
    if mirror < neighbors.count && is_mirror(surface) {
        let dir = radiance_sample_direction(layer.N, layer.R, layer.roughness);
        let near = near_radiance(mirror, surface.world_position.xyz, dir, layer.perceptual_roughness);
        return reflectance(surface, layer) * (near * occlusion - room * surface.specular_occlusion);
    }
#endif
#endif
#endif
    return vec3f(0.0);
}

/// Radiance that the engine reflects, in frame buffer units. To be called outside of all branches: SwiftShader indexes
/// arrays of textures, which hold Bevy's light probes, by the first of four pixels even if that one takes no part in a
/// branch, or none does, and the index means nothing.
fn room_radiance(surface: PbrInput) -> vec3f {
#ifdef ENVIRONMENT_MAP
    let view_z = (view.view_from_world * surface.world_position).z;
    let cluster = clustering::view_fragment_cluster_index(surface.frag_coord.xy, view_z, surface.is_orthographic);
    var ranges = clustering::unpack_clusterable_object_index_ranges(cluster);
    return compute_radiances(base_layer(surface), &ranges, surface.world_position.xyz, true).radiance * view.exposure;
#else
    return vec3f(0.0);
#endif
}

#ifdef ENVIRONMENT_MAP
fn is_mirror(surface: PbrInput) -> bool {
    let material = surface.material;
    let F0 = calculate_F0(material.base_color.rgb, material.metallic, material.reflectance);
    return max(F0.r, max(F0.g, F0.b)) >= MIN_REFLECTANCE && material.perceptual_roughness < MAX_ROUGHNESS;
}

fn base_layer(surface: PbrInput) -> LayerLightingInput {
    var layer: LayerLightingInput;
    layer.N = surface.N;
    layer.R = reflect(-surface.V, surface.N);
    layer.NdotV = max(dot(surface.N, surface.V), 0.0001);
    layer.perceptual_roughness = surface.material.perceptual_roughness;
    layer.roughness = perceptualRoughnessToRoughness(layer.perceptual_roughness);
    return layer;
}

/// Fraction of the mean radiance around the reflected direction that a surface reflects, as in Bevy's
/// environment_map.wgsl.
fn reflectance(surface: PbrInput, layer: LayerLightingInput) -> vec3f {
    let material = surface.material;
    let F0 = calculate_F0(material.base_color.rgb, material.metallic, material.reflectance);
    let F_ab = F_AB(layer.perceptual_roughness, layer.NdotV);
    var reflected = (F0 * F_ab.x + F_ab.y) * saturate(dot(F0, vec3f(FADING)));
#ifdef STANDARD_MATERIAL_CLEARCOAT
    let coat_cos = max(dot(surface.clearcoat_N, surface.V), 0.0001);
    let left = 1.0 - F_Schlick(0.04, 1.0, coat_cos) * material.clearcoat;
    reflected *= left * left;
#endif
    return reflected;
}
#endif
