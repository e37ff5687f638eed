// Uniforms of toon surfaces.

#define_import_path bevy_mirrorball::materials::toon::toon_bindings

/// Mirror of `ToonUniform` in `toon_uniform.rs`.
struct Toon {
    /// Towards the light that the author chose, or 0.
    key_direction: vec3f,
    /// Number of bands, 2 to 5.
    bands: f32,
    /// 1 with a highlight, 0 without.
    highlight: f32,
    /// Largest brightness of the dark color, as a fraction of the brightest light, so that bands stay distinguishable
    /// in any room.
    max_dark: f32,
    /// Half width of band edges, as a fraction of a band.
    edge_half_width: f32,
    /// Strength of the rim light.
    rim: f32,
    /// Coefficients of Kunze's formula.
    diffuse: f32,
    specular: f32,
    exponent: f32,
    /// Fraction of the measured light that counts.
    measured_light: f32,
}

/// Mirror of `RampsUniform` in `ramps.rs`.
struct Ramps {
    diffuse: array<vec4f, 256>,
    specular: array<vec4f, 256>,
    /// Numbers of steps.
    diffuse_steps: f32,
    specular_steps: f32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(106) var<uniform> toon: Toon;
@group(#{MATERIAL_BIND_GROUP}) @binding(107) var<uniform> ramps: Ramps;
