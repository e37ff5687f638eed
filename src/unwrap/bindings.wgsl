// Bindings of the unwrap pass.

#define_import_path bevy_mirrorball::unwrap::bindings

#import bevy_mirrorball::probe::mirror_ball::Ball
#import bevy_mirrorball::probe::solids::Solid

/// Mirror of `UnwrapUniform` in `unwrap_uniform.rs`.
struct Unwrap {
    ball: Ball,
    /// Rotation from world to camera space.
    camera_from_world: mat3x3f,
    /// Focal lengths and principal point in pixels; of a lens: radius of its picture (twice) and middle; of an equirectangular
    /// picture its size and 0.
    focal: vec2f,
    center: vec2f,
    /// Factor on pixels clipped by light from straight above the marker's paper; w: 1 if `uniform_radiance` replaces the picture.
    gain: vec4f,
    /// Normal of the marker's paper, camera space.
    up_camera: vec3f,
    /// Largest factor between a clipped channel and the brightest other one.
    max_saturation: f32,
    uniform_radiance: vec3f,
    /// Luminance from which a pixel with a clipped channel is clipped in all.
    white_from: f32,
    /// Factor on what was seen earlier.
    history_scale: vec3f,
    /// What is left of the confidence in it, 0…1.
    history_keep: f32,
    /// 1 ÷ the rim's distance from the middle in focal lengths, at the lens's projection: equidistant, equisolid, stereographic,
    /// orthographic.
    lens: vec4f,
    /// Half the lens's field of view, in radians.
    half_fov: f32,
    /// Factor on the view direction in the half vector of a sphere map.
    wrap: f32,
    /// Linear values from here on are clipped.
    clipped_from: f32,
    /// 1 if `clip_gains` replaces `gain`.
    gains_by_direction: f32,
    /// Factor on the confidence in this picture.
    confidence: f32,
    /// And the least there is.
    min_confidence: f32,
    /// Share of the answer that replaces what the cube holds: below 1 while one environment fades into another.
    weight: f32,
    /// 1 if what lies around is known.
    has_solids: f32,
    /// 1 if what the cube holds is of an earlier time, 0 if it is of this very one, from another picture.
    history_is_old: f32,
}

@group(0) @binding(0) var frame: texture_2d<f32>;
@group(0) @binding(1) var<uniform> unwrap: Unwrap;
/// Factor on clipped pixels towards each cell of a cube.
@group(0) @binding(2) var<storage, read> clip_gains: array<vec4f>;
/// What may hide the ball.
@group(0) @binding(3) var<storage, read> blockers: array<Solid>;
/// What the ball would show if it had more pixels.
@group(0) @binding(4) var<storage, read> surroundings: array<Solid>;
/// What the cube holds; alpha: confidence.
@group(0) @binding(5) var history: texture_2d_array<f32>;
@group(0) @binding(6) var cube: texture_storage_2d_array<rgba16float, write>;
