// Radiance of the room in a direction, as its environment was captured, in frame buffer units.

#define_import_path bevy_mirrorball::materials::neighbors::captured

#ifdef ENVIRONMENT_MAP
#import bevy_pbr::environment_map::quat_rotate
#import bevy_pbr::mesh_view_bindings as view_bindings

#ifdef MULTIPLE_LIGHT_PROBES_IN_ARRAY
fn environment_of_view(dir_cube: vec3f) -> vec3f {
    return textureSampleLevel(
        view_bindings::specular_environment_maps[max(view_bindings::light_probes.view_cubemap_index, 0)],
        view_bindings::environment_map_sampler,
        dir_cube,
        0.0,
    ).rgb;
}
#else
fn environment_of_view(dir_cube: vec3f) -> vec3f {
    return textureSampleLevel(
        view_bindings::specular_environment_map,
        view_bindings::environment_map_sampler,
        dir_cube,
        0.0,
    ).rgb;
}
#endif

/// Radiance that the view's environment has in a direction, whatever light probes are there.
fn captured_radiance(dir_world: vec3f) -> vec3f {
    // The frame of a cube is left-handed: its +z is the world's −Z.
    let dir_cube = quat_rotate(view_bindings::light_probes.view_rotation, dir_world) * vec3f(1.0, 1.0, -1.0);
    let brightness = view_bindings::light_probes.intensity_for_view * view_bindings::view.exposure;
    let has_map = view_bindings::light_probes.view_cubemap_index >= 0;
    return select(vec3f(0.0), environment_of_view(dir_cube) * brightness, has_map);
}
#endif
