// Bindings of the unwrap pass.

#define_import_path bevy_mirrorball::unwrap::bindings

#import bevy_mirrorball::probe::ball_view::Ball
#import bevy_mirrorball::probe::solids::Solid

/// Mirror of `UnwrapUniform` in `unwrap_uniform.rs`.
struct Unwrap {
    ball: Ball,
    /// Rotation from world to camera space.
    camera_from_world: mat3x3f,
    /// Focal lengths in pixels. For a lens: radius of its image circle, twice; for an equirectangular image: its size.
    focal: vec2f,
    /// Principal point in pixels. For a lens: center of its image circle; for an equirectangular image: 0.
    center: vec2f,
    /// Factor on pixels clipped by light from straight above the marker's paper; w: 1 if `uniform_radiance` replaces
    /// the frame.
    gain: vec4f,
    /// Normal of the marker's paper, camera space.
    up_camera: vec3f,
    /// Largest factor between a clipped channel and the brightest other one.
    max_saturation: f32,
    /// Radiance of all directions, in camera units.
    uniform_radiance: vec3f,
    /// Luminance from which all channels of a pixel with one clipped channel count as clipped.
    white_from: f32,
    /// Factor on the radiance in the history.
    history_scale: vec3f,
    /// Factor on the confidence in the history, 0…1.
    history_keep: f32,
    /// 1 ÷ distance of the rim from the center in focal lengths, in the component of the lens's projection, 0 in the
    /// others: equidistant, equisolid, stereographic, orthographic.
    lens: vec4f,
    /// Half the lens's field of view, in radians.
    half_fov: f32,
    /// Factor on the view direction in the half vector of a sphere map.
    wrap: f32,
    /// Linear value from which a channel is clipped.
    clipped_from: f32,
    /// 1 if `clip_gains` replaces `gain`.
    gains_by_direction: f32,
    /// Factor on the confidence in this frame.
    confidence: f32,
    /// Lower limit of the confidence in this frame.
    min_confidence: f32,
    /// Weight of the result against the content of the cube; below 1 while one environment fades into another.
    weight: f32,
    /// 1 if `surroundings` are known.
    has_solids: f32,
    /// 1 if the history is from an earlier time, 0 if it is from another frame of this time.
    history_is_old: f32,
}

@group(0) @binding(0) var frame: texture_2d<f32>;
@group(0) @binding(1) var<uniform> unwrap: Unwrap;
/// Factor on clipped pixels for each cell of a cube of directions; then direction and squared radius of a small light,
/// and its radiance.
@group(0) @binding(2) var<storage, read> clip_gains: array<vec4f>;
/// Solids that may hide the ball.
@group(0) @binding(3) var<storage, read> blockers: array<Solid>;
/// Solids that the frame shows better than the ball does.
@group(0) @binding(4) var<storage, read> surroundings: array<Solid>;
/// Content of the cube before this dispatch; alpha: confidence.
@group(0) @binding(5) var history: texture_2d_array<f32>;
@group(0) @binding(6) var cube: texture_storage_2d_array<rgba16float, write>;
