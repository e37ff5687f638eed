// Which share of the environment's light arrives at a point, per color channel. The formulas are in mod.rs.

#define_import_path bevy_mirrorball::shadows::visibility

#import bevy_mirrorball::shadows::dome::{Dome, atlas_uv, view_position}

@group(#{MATERIAL_BIND_GROUP}) @binding(100) var atlas: texture_depth_2d;
@group(#{MATERIAL_BIND_GROUP}) @binding(101) var atlas_sampler: sampler_comparison;
@group(#{MATERIAL_BIND_GROUP}) @binding(102) var<storage, read> dome: Dome;
@group(#{MATERIAL_BIND_GROUP}) @binding(103) var<storage, read> weights: array<vec4f>;

const VIRTUAL_CASTERS: u32 = 0u;
const PHANTOM_CASTERS: u32 = 1u;
/// Light left below this share of the open sky's counts as none; there the picture is left alone.
const LEAST_LIGHT: f32 = 1e-4;
/// A surface looks at its own shadow map this many texels above itself.
const SELF_SHADOW_OFFSET: f32 = 1.5;
/// Visibility from here on is full; hides the rounding of the hardware's filter.
const FULLY_VISIBLE: f32 = 0.999;

/// 1 where casters of a kind let the light of a direction through, 0 where they block it.
fn visibility(casters: u32, index: u32, pos_world: vec3f) -> f32 {
    let pos = view_position(dome.views[index], pos_world);
    if any(abs(pos.xy) > vec2f(1.0)) {
        return 1.0;
    }
    let uv = atlas_uv(dome.counts, casters * dome.counts.x + index, pos.xy);
    return textureSampleCompareLevel(atlas, atlas_sampler, uv, clamp(pos.z, 0.0, 1.0));
}

/// Position above a surface from which the surface does not shadow itself, for light from a direction.
fn above_surface(pos_world: vec3f, normal: vec3f, cos_angle: f32) -> vec3f {
    let sin_angle = sqrt(max(1.0 - cos_angle * cos_angle, 0.0));
    return pos_world + normal * (SELF_SHADOW_OFFSET * dome.params.x * (0.2 + 0.8 * sin_angle));
}

fn is_in_virtual_shadow(pos_world: vec3f, normal: vec3f) -> bool {
    for (var i = 0u; i < dome.counts.x; i++) {
        if dot(normal, dome.views[i].direction.xyz) > 0.0 && visibility(VIRTUAL_CASTERS, i, pos_world) < FULLY_VISIBLE {
            return true;
        }
    }
    return false;
}

/// Factor on the camera's picture of a phantom.
fn phantom_ratio(pos_world: vec3f, normal: vec3f) -> vec3f {
    if !is_in_virtual_shadow(pos_world, normal) {
        return vec3f(1.0);
    }
    var open_sky = vec3f(0.0);
    var before = vec3f(0.0);
    var after = vec3f(0.0);
    for (var i = 0u; i < dome.counts.y; i++) {
        let cos_angle = dot(normal, dome.views[i].direction.xyz);
        if cos_angle <= 0.0 {
            continue;
        }
        let light = weights[i].rgb * cos_angle;
        open_sky += light;
        if i >= dome.counts.x {
            before += light;
            after += light;
            continue;
        }
        let real = light * visibility(PHANTOM_CASTERS, i, above_surface(pos_world, normal, cos_angle));
        before += real;
        after += real * visibility(VIRTUAL_CASTERS, i, pos_world);
    }
    return select(vec3f(1.0), after / max(before, vec3f(1e-20)), before > LEAST_LIGHT * open_sky);
}

/// Factor on the diffuse image-based light of a virtual surface.
fn virtual_ratio(pos_world: vec3f, normal: vec3f) -> vec3f {
    let phantom_light = weights[dome.counts.y].rgb;
    let cell = 6.28318530718 / f32(max(dome.counts.x, 1u));
    var open_sky = vec3f(0.0);
    var arriving = vec3f(0.0);
    for (var i = 0u; i < dome.counts.y; i++) {
        let cos_angle = dot(normal, dome.views[i].direction.xyz);
        if cos_angle <= 0.0 {
            continue;
        }
        let light = weights[i].rgb;
        open_sky += light * cos_angle;
        if i >= dome.counts.x {
            arriving += light * cos_angle;
            continue;
        }
        let past_phantoms = visibility(PHANTOM_CASTERS, i, pos_world);
        let past_virtual = visibility(VIRTUAL_CASTERS, i, above_surface(pos_world, normal, cos_angle));
        arriving += mix(phantom_light * cell, light, past_phantoms) * past_virtual * cos_angle;
    }
    return select(vec3f(1.0), arriving / max(open_sky, vec3f(1e-20)), open_sky > vec3f(1e-6));
}
