// The strongest real light, for materials that bind it.

#define_import_path bevy_mirrorball::materials::strongest_light

/// Mirror of `LightUniform` in `strongest_light.rs`.
struct StrongestLight {
    /// Towards the light.
    direction: vec3f,
    /// What white paper that faces the light shows of it, in linear camera units. 0 without a light.
    paper_radiance: vec3f,
    /// The same direction, which turns steadily when another light becomes the strongest.
    key_direction: vec3f,
    /// How much this light is the key light, 0…1.
    key_weight: f32,
    /// The ball as a sphere map, for mirrored and for diffuse light, as `classic/sphere_map.rs` makes them.
    sphere_map: array<vec4f, 1280>,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(105) var<storage, read> strongest_light: StrongestLight;
