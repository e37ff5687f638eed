// StandardMaterial in a classic model: sums of lookups in the view's environment maps. The formulas are in the
// documentation of materials/mod.rs. All of them are one sum with different coefficients, without branches.
//
// Definitions: DOME: there is a dome, whose shadows fall on the surface. SPHERE_MAP: the light is that of the ball in
// the camera frame.

#import bevy_pbr::{
    forward_io::{FragmentOutput, VertexOutput},
    mesh_types::MESH_FLAGS_SHADOW_RECEIVER_BIT,
    mesh_view_bindings::view,
    pbr_types::{PbrInput, STANDARD_MATERIAL_FLAGS_UNLIT_BIT},
}
#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::materials::engine_features::{finished_surface, output_of, sampled_surface}
#import bevy_mirrorball::materials::strongest_light::strongest_light
#import bevy_mirrorball::materials::view_environment::{view_brightness, view_irradiance, view_radiance}
#ifdef SPHERE_MAP
#import bevy_mirrorball::materials::classic::sphere_map::{sphere_irradiance, sphere_radiance}
#endif
#ifdef DOME
#import bevy_mirrorball::shadows::render::receive::{reflection_ratio, virtual_ratio}
#endif

/// Mirror of `ClassicUniform` in `classic_uniform.rs`.
struct Classic {
    /// Light without direction, in frame buffer units.
    ambient: f32,
    /// Factor on the diffuse map.
    diffuse: f32,
    /// Factor on the highlight of the strongest light, and the exponent of its lobe.
    specular: f32,
    exponent: f32,
    /// Factor on the specular map.
    reflection: f32,
    /// 1 if alpha of the base color mixes both maps, otherwise 0.
    gloss_map: f32,
    /// Perceptual roughness of the reflection; negative: that of the surface.
    roughness: f32,
    /// Index of refraction outside ÷ inside, with which the environment is seen through the surface; 0: it is mirrored.
    refraction: f32,
    /// Fraction of perpendicular light that is mirrored; 1: all of it, from all sides.
    perpendicular: f32,
    /// Luminance below which nothing is mirrored.
    threshold: f32,
    /// Fraction of the measured light that counts.
    measured_light: f32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(106) var<uniform> classic: Classic;

/// Smallest light that counts, in frame buffer units; also keeps divisors above zero.
const MIN_LIGHT: f32 = 1e-6;
/// Smallest fraction of a surface's light for which shadows are taken to be those of the strongest light.
const MIN_LIGHT_FRACTION: f32 = 0.3;

#ifdef DOME
/// Fraction of the diffuse light that arrives.
fn diffuse_left(in: VertexOutput, surface: PbrInput) -> vec3f {
    let is_receiver = (surface.flags & MESH_FLAGS_SHADOW_RECEIVER_BIT) != 0u;
    return select(vec3f(1.0), virtual_ratio(in.position, in.world_position.xyz, surface.N), is_receiver);
}

/// Fraction of the reflection that arrives.
fn reflection_left(left: vec3f, surface: PbrInput, roughness: f32) -> f32 {
    return reflection_ratio(left, dot(surface.N, surface.V), roughness);
}
#else
fn diffuse_left(in: VertexOutput, surface: PbrInput) -> vec3f {
    return vec3f(1.0);
}

fn reflection_left(left: vec3f, surface: PbrInput, roughness: f32) -> f32 {
    return 1.0;
}
#endif

/// Direction in which the environment is seen in or through a surface.
fn seen_direction(surface: PbrInput) -> vec3f {
    let mirrored = reflect(-surface.V, surface.N);
    let refracted = refract(-surface.V, surface.N, classic.refraction);
    // There is none at total reflection.
    let is_refracted = classic.refraction > 0.0 && dot(refracted, refracted) > 0.5;
    return select(mirrored, refracted, is_refracted);
}

#ifdef SPHERE_MAP
/// What white paper in place of the surface shows, without shadows.
fn diffuse_light(surface: PbrInput) -> vec3f {
    return sphere_irradiance(surface.N, surface.V);
}

/// What is seen in the surface.
fn mirrored_light(surface: PbrInput, roughness: f32) -> vec3f {
    return sphere_radiance(surface.N, surface.V);
}
#else
/// What white paper in place of the surface shows, without shadows.
fn diffuse_light(surface: PbrInput) -> vec3f {
    return view_irradiance(surface.N);
}

/// What is seen in or through the surface.
fn mirrored_light(surface: PbrInput, roughness: f32) -> vec3f {
    return view_radiance(seen_direction(surface), roughness);
}
#endif

/// Fraction of the light that is mirrored (Schlick 1994).
fn fresnel(surface: PbrInput) -> f32 {
    let from_grazing = 1.0 - saturate(dot(surface.N, surface.V));
    let squared = from_grazing * from_grazing;
    return mix(classic.perpendicular, 1.0, squared * squared * from_grazing);
}

/// What is left of a radiance if the threshold is taken from its luminance.
fn above_threshold(radiance: vec3f) -> vec3f {
    return radiance * saturate(1.0 - classic.threshold / max(luminance(radiance), MIN_LIGHT));
}

/// Highlight of the strongest light (Blinn 1977). A shadow takes it first: what the surface lacks of its diffuse light
/// `open` counts as lacking from this light.
fn highlight(surface: PbrInput, open: vec3f, left: vec3f) -> vec3f {
    let paper_radiance = strongest_light.paper_radiance * (view_brightness() * classic.measured_light);
    let between = strongest_light.direction + surface.V;
    let dir_between = between * inverseSqrt(max(dot(between, between), MIN_LIGHT));
    let lobe = pow(max(dot(surface.N, dir_between), MIN_LIGHT), classic.exponent);
    let cos_light = dot(surface.N, strongest_light.direction);
    let fraction = luminance(paper_radiance) * cos_light / max(luminance(open), MIN_LIGHT);
    let lacking = (1.0 - luminance(left)) / clamp(fraction, MIN_LIGHT_FRACTION, 1.0);
    return select(vec3f(0.0), paper_radiance * (lobe * saturate(1.0 - lacking)), cos_light > 0.0);
}

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> FragmentOutput {
    let sampled = sampled_surface(in, is_front);
    let surface = finished_surface(in, sampled);
    let material = surface.material;
    let base_color = material.base_color;
    let roughness = select(classic.roughness, material.perceptual_roughness, classic.roughness < 0.0);

    let open = diffuse_light(surface) * classic.measured_light;
    let seen = mirrored_light(surface, roughness);
    let left = diffuse_left(in, surface);
    let matte = open * left * surface.diffuse_occlusion;
    let mirrored = above_threshold(seen) * (fresnel(surface) * surface.specular_occlusion * classic.measured_light
        * reflection_left(left, surface, roughness));

    let diffuse_weight = classic.diffuse * mix(1.0, sampled.material.base_color.a, classic.gloss_map);
    let tinted = base_color.rgb * (1.0 - sampled.material.base_color.a);
    let reflection_weight = classic.reflection * mix(vec3f(1.0), tinted, classic.gloss_map);
    let shaded = base_color.rgb * (classic.ambient + diffuse_weight * matte) + reflection_weight * mirrored
        + classic.specular * highlight(surface, open, left);

    let glow = material.emissive.rgb * base_color.a * mix(1.0, view.exposure, material.emissive.a);
    let is_unlit = (material.flags & STANDARD_MATERIAL_FLAGS_UNLIT_BIT) != 0u;
    return output_of(in, surface, select(vec4f(shaded + glow, base_color.a), base_color, is_unlit));
}
