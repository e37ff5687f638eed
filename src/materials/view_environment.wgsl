// Light of the view's environment map in a direction, in frame buffer units, whatever light probes are there. 0 without
// a map.

#define_import_path bevy_mirrorball::materials::view_environment

#ifdef ENVIRONMENT_MAP
#import bevy_pbr::environment_map::quat_rotate
#import bevy_pbr::mesh_view_bindings as view_bindings
#import bevy_mirrorball::luminance::luminance

#ifdef MULTIPLE_LIGHT_PROBES_IN_ARRAY
fn diffuse_texel(dir_cube: vec3f) -> vec3f {
    return textureSampleLevel(
        view_bindings::diffuse_environment_maps[max(view_bindings::light_probes.view_cubemap_index, 0)],
        view_bindings::environment_map_sampler,
        dir_cube,
        0.0,
    ).rgb;
}

fn specular_texel(dir_cube: vec3f, level: f32) -> vec3f {
    return textureSampleLevel(
        view_bindings::specular_environment_maps[max(view_bindings::light_probes.view_cubemap_index, 0)],
        view_bindings::environment_map_sampler,
        dir_cube,
        level,
    ).rgb;
}
#else
fn diffuse_texel(dir_cube: vec3f) -> vec3f {
    return textureSampleLevel(
        view_bindings::diffuse_environment_map, view_bindings::environment_map_sampler, dir_cube, 0.0,
    ).rgb;
}

fn specular_texel(dir_cube: vec3f, level: f32) -> vec3f {
    return textureSampleLevel(
        view_bindings::specular_environment_map, view_bindings::environment_map_sampler, dir_cube, level,
    ).rgb;
}
#endif

/// Direction in the map of a direction in the world. The frame of a cube is left-handed: its +z is the world's −Z.
fn cube_direction(dir_world: vec3f) -> vec3f {
    return quat_rotate(view_bindings::light_probes.view_rotation, dir_world) * vec3f(1.0, 1.0, -1.0);
}

/// Factor from the map's units to those of the frame buffer.
fn view_brightness() -> f32 {
    let brightness = view_bindings::light_probes.intensity_for_view * view_bindings::view.exposure;
    return select(0.0, brightness, view_bindings::light_probes.view_cubemap_index >= 0);
}

/// Irradiance ÷ π of a surface that faces a direction: what white paper shows.
fn view_irradiance(normal: vec3f) -> vec3f {
    return diffuse_texel(cube_direction(normal)) * view_brightness();
}

/// Difference of the map between one direction and its opposite, in luminance.
fn difference_along(dir_cube: vec3f) -> f32 {
    return luminance(diffuse_texel(dir_cube) - diffuse_texel(-dir_cube));
}

/// Light vector of the map ÷ π, in luminance. For any light, irradiance at n minus irradiance at −n equals n · (light
/// vector), so three pairs of opposite directions give it exactly (Gershun 1936, *The Light Field*).
fn view_light_vector() -> vec3f {
    let along_x = difference_along(vec3f(1.0, 0.0, 0.0));
    let along_y = difference_along(vec3f(0.0, 1.0, 0.0));
    let along_z = difference_along(vec3f(0.0, 0.0, 1.0));
    let rotation = view_bindings::light_probes.view_rotation;
    let world_from_map = vec4f(-rotation.xyz, rotation.w);
    return quat_rotate(world_from_map, vec3f(along_x, along_y, -along_z)) * view_brightness();
}

/// Mean radiance around a direction, as far around it as a surface of this perceptual roughness mirrors.
fn view_radiance(dir_world: vec3f, perceptual_roughness: f32) -> vec3f {
    let level = perceptual_roughness * f32(view_bindings::light_probes.smallest_specular_mip_level_for_view);
    return specular_texel(cube_direction(dir_world), level) * view_brightness();
}
#else
fn view_brightness() -> f32 {
    return 0.0;
}

fn view_light_vector() -> vec3f {
    return vec3f(0.0);
}

fn view_irradiance(normal: vec3f) -> vec3f {
    return vec3f(0.0);
}

fn view_radiance(dir_world: vec3f, perceptual_roughness: f32) -> vec3f {
    return vec3f(0.0);
}
#endif
