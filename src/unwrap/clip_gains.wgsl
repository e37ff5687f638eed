// Gains of clipped pixels by direction.

#define_import_path bevy_mirrorball::unwrap::clip_gains

#import bevy_mirrorball::unwrap::bindings::{clip_gains, unwrap}

/// Cells along an edge of the cube of gains, `ClipGains::EDGE`.
const GAINS_EDGE: u32 = 32u;

/// Index of a world direction among the gains. Twin of `cell_index` in `radiance_cells.rs`.
fn sky_cell(dir: vec3f) -> u32 {
    let size = abs(dir);
    var along = dir.zxy;
    var axis = 2u;
    if size.x >= size.y && size.x >= size.z {
        along = dir;
        axis = 0u;
    } else if size.y >= size.z {
        along = dir.yxz;
        axis = 1u;
    }
    let face = 2u * axis + select(0u, 1u, along.x < 0.0);
    let p = vec2u((along.yz / abs(along.x) * 0.5 + 0.5) * f32(GAINS_EDGE));
    let cell = min(p, vec2u(GAINS_EDGE - 1u));
    return (face * GAINS_EDGE + cell.y) * GAINS_EDGE + cell.x;
}

/// Radiance of the small light in the cube, which is a spot of a few texels. Twin of `ClipGains::new`.
fn small_light(dir_world: vec3f) -> vec3f {
    let light = clip_gains[6u * GAINS_EDGE * GAINS_EDGE];
    let radiance = clip_gains[6u * GAINS_EDGE * GAINS_EDGE + 1u].rgb;
    let off = dir_world - light.xyz;
    let weight = max(1.0 - dot(off, off) / max(light.w, 1e-9), 0.0);
    return select(vec3f(0.0), radiance * weight, light.w > 0.0 && unwrap.gains_by_direction > 0.5);
}

/// Gain of clipped light from a direction.
fn gain_from(dir_world: vec3f, dir_camera: vec3f) -> vec3f {
    // The least extra light that explains the paper's brightness is proportional to the cosine at which it arrives.
    let gain_by_paper = 1.0 + (unwrap.gain.rgb - 1.0) * max(dot(dir_camera, unwrap.up_camera), 0.0);
    return select(gain_by_paper, clip_gains[sky_cell(dir_world)].rgb, unwrap.gains_by_direction > 0.5);
}
