// Picture with light from many directions → environment cube, merged with what is known already.
//
// BALL: the picture shows a mirrored ball; FISHEYE, EQUIRECT: it is taken that way; none of them: it is a cropped sphere map.

#import bevy_mirrorball::probe::mirror_ball::{
    Ball, side_of, angle_from, ball_point, normal_angle, neighboring_normal_angle,
}
#import bevy_mirrorball::probe::solids::{Solid, hidden_share, inside_of}
#import bevy_mirrorball::environment_map::cubemap::face_direction
#import bevy_mirrorball::trigonometry::{angle_of, unit_vector}

/// Mirror of `UnwrapUniform` in extract.rs.
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
    most_saturation: f32,
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
    least_confidence: f32,
    /// Share of the answer that replaces what the cube holds: below 1 while one environment fades into another.
    share: f32,
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

const PI: f32 = 3.14159265358979;
/// tan 1.57, beyond which the stereographic projection stays the same.
const STEEPEST_STEREOGRAPHIC: f32 = 1255.7656;
/// Most lookups per texel along each axis; one for each pixel that it covers up to there.
const MOST_SAMPLES: f32 = 4.0;
/// How much steeper than linear the passage from pixel to pixel is, so that a pixel's mean stays its own (4 % leak to each
/// neighbor instead of 12.5 %).
const SHARP: f32 = 3.0;
/// The same for a ball, whose pixels are made up for what they leak: less steep, so that they do not show as squares.
const SHARP_BALL: f32 = 2.0;
/// Linear, for the rim of a ball, where a pixel spans so many degrees that its middle counts more than its mean.
const SMOOTH: f32 = 1.0;
/// Share of a pixel that gets to the neighbor on one side, per standard deviation of what spreads it, in pixels: half the mean size of
/// a normal deviate.
const LEAK: f32 = 0.4;
/// A leak of half a pixel could not be made up for at all; that of a texel as large as a pixel is 0.17.
const MOST_LEAK: f32 = 0.25;
/// Texel sizes in pixels from which on less and nothing is made up for: two texels per pixel can follow single pixels, one
/// cannot and would only get harder edges than the room has.
const COARSE: vec2f = vec2f(0.5, 1.0);
/// Cells along an edge of the cube of gains, `ClipGains::EDGE`.
const GAINS_EDGE: u32 = 32u;
/// Points of the rim that a hidden direction is the mean of.
const RING: u32 = 12u;
/// The largest value stored; far below the 65504 of half floats, so that sums of a few texels still fit.
const MAX_RADIANCE: f32 = 60000.0;
/// Confidence of what is only guessed.
const LEAST_CONFIDENCE: f32 = 0.001;
/// Pixels over which confidence falls off, at the picture's border and beside what hides the ball.
const SOFT_PIXELS: f32 = 4.0;
/// Confidence from which on what was seen earlier counts fully where nothing is seen now; a fifth of what a ball 50 pixels wide has in
/// its middle.
const USUAL_CONFIDENCE: f32 = 0.03;
/// Angles inside the rim over which the picture itself takes over from the ball's coarse image of it, in radians.
const RIM: vec2f = vec2f(0.6, 0.15);

/// A pixel as the camera gave it.
fn photographed(pixel: vec2i) -> vec3f {
    let size = vec2i(textureDimensions(frame));
#ifdef EQUIRECT
    let column = ((pixel.x % size.x) + size.x) % size.x;
    return textureLoad(frame, vec2i(column, clamp(pixel.y, 0, size.y - 1)), 0).rgb;
#else
    return textureLoad(frame, clamp(pixel, vec2i(0), size - 1), 0).rgb;
#endif
}

/// A pixel with its clipped channels multiplied, but none beyond what its other channels make likely. Twin of `gain_limits`
/// in recovery.rs.
fn recovered(pixel: vec2i, gain: vec3f) -> vec3f {
    let value = photographed(pixel);
    let is_clipped = value >= vec3f(unwrap.clipped_from);
    if !any(is_clipped) {
        return value;
    }
    if dot(value, vec3f(0.2126, 0.7152, 0.0722)) >= unwrap.white_from {
        return value * gain;
    }
    let unclipped = select(value, vec3f(0.0), is_clipped);
    let most = unwrap.most_saturation * max(unclipped.r, max(unclipped.g, unclipped.b));
    return select(value, clamp(value * gain, value, max(vec3f(most), value)), is_clipped);
}

/// Lookup between four pixels; the gain is applied to each pixel, before pixels are mixed.
fn sample_frame(pixel: vec2f, gain: vec3f, sharpness: f32) -> vec3f {
    let corner = floor(pixel - 0.5);
    let t = clamp((pixel - 1.0 - corner) * sharpness + 0.5, vec2f(0.0), vec2f(1.0));
    let p = vec2i(corner);
    let top = mix(recovered(p, gain), recovered(p + vec2i(1, 0), gain), t.x);
    let bottom = mix(recovered(p + vec2i(0, 1), gain), recovered(p + vec2i(1, 1), gain), t.x);
    return mix(top, bottom, t.y);
}

/// Mean over the parallelogram around a pixel position that a texel covers.
fn mean_of_frame(pixel: vec2f, texel: mat2x2f, gain: vec3f, sharpness: f32) -> vec3f {
    let count = clamp(ceil(vec2f(length(texel[0]), length(texel[1]))), vec2f(1.0), vec2f(MOST_SAMPLES));
    let columns = u32(count.x);
    let samples = columns * u32(count.y);
    var sum = vec3f(0.0);
    var i = 0u;
    // Asked for its end after the work: software Vulkan does the work once more to find out, which here mostly is as much again.
    loop {
        let offset = (vec2f(vec2u(i % columns, i / columns)) + 0.5) / count - 0.5;
        sum += sample_frame(pixel + texel * offset, gain, sharpness);
        continuing {
            i++;
            break if i >= samples;
        }
    }
    return sum / (count.x * count.y);
}

/// Place of a world direction among the gains. Twin of `cell_index` in `radiance_cells.rs`.
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

/// The gain of clipped light from a direction.
fn gain_from(dir_world: vec3f, dir_camera: vec3f) -> vec3f {
    // The least extra light that explains the paper: proportional to how much of it the paper catches, none from below.
    let gain_by_paper = 1.0 + (unwrap.gain.rgb - 1.0) * max(dot(dir_camera, unwrap.up_camera), 0.0);
    return select(gain_by_paper, clip_gains[sky_cell(dir_world)].rgb, unwrap.gains_by_direction > 0.5);
}

/// World direction of a position (-1…1) on a cube face. Lookups negate z, so the faces are stored mirrored in z.
fn world_direction(face: u32, p: vec2f) -> vec3f {
    return face_direction(face, p) * vec3f(1.0, 1.0, -1.0);
}

/// 1 inside of the picture, falling to 0 at its border.
fn inside_frame(pixel: vec2f) -> f32 {
    let inset = min(pixel, vec2f(textureDimensions(frame)) - pixel);
    return clamp(min(inset.x, inset.y) / SOFT_PIXELS, 0.0, 1.0);
}

/// What a picture says about a direction.
struct Seen {
    /// The best guess from this picture alone.
    radiance: vec3f,
    /// Pixels per texel, per side, at most 1.
    resolution: f32,
    /// Whether the picture shows the direction at all, 0…1.
    shown: f32,
    /// Whether `radiance` is better than an old measurement though the direction is not shown, 0…1.
    guessed: f32,
}

#ifdef BALL
/// What a pixel has more than its neighbors, times a share for those beside and those above and below. A clipped one keeps what
/// it has: how much more it should get, nobody knows.
fn excess(value: vec3f, beside: vec3f, above_and_below: vec3f, share: vec2f) -> vec3f {
    let more = share.x * (2.0 * value - beside) + share.y * (2.0 * value - above_and_below);
    return select(more, vec3f(0.0), any(value >= vec3f(unwrap.clipped_from)));
}

/// What a lookup lacks so that the cube, read linearly between its texels, gives back the pixels of the picture. A step of Van Cittert's
/// deconvolution (1931): the passage between pixels and that between texels spread each pixel over its neighbors by a known
/// share, which is taken back from them. Beside a lamp that is light of the lamp, which counts as white already.
fn leaked(pixel: vec2f, texel: mat2x2f, sharpness: f32) -> vec3f {
    // Variances of a box as wide as the passage and of a triangle two texels wide, along the picture's axes.
    let spread = 1.0 / (12.0 * sharpness * sharpness) + (texel[0] * texel[0] + texel[1] * texel[1]) / 6.0;
    let leak = min(LEAK * sqrt(spread), vec2f(MOST_LEAK));
    let is_fine = clamp((COARSE.y - sqrt(abs(determinant(texel)))) / (COARSE.y - COARSE.x), 0.0, 1.0);
    let share = is_fine * leak / (1.0 - 2.0 * leak);
    let corner = floor(pixel - 0.5);
    let t = clamp((pixel - 1.0 - corner) * sharpness + 0.5, vec2f(0.0), vec2f(1.0));
    let p = vec2i(corner);
    let top_left = photographed(p);
    let top_right = photographed(p + vec2i(1, 0));
    let bottom_left = photographed(p + vec2i(0, 1));
    let bottom_right = photographed(p + vec2i(1, 1));
    let top = mix(
        excess(top_left, photographed(p - vec2i(1, 0)) + top_right, photographed(p - vec2i(0, 1)) + bottom_left, share),
        excess(top_right, top_left + photographed(p + vec2i(2, 0)), photographed(p + vec2i(1, -1)) + bottom_right, share),
        t.x,
    );
    let bottom = mix(
        excess(bottom_left, photographed(p + vec2i(-1, 1)) + bottom_right, top_left + photographed(p + vec2i(0, 2)), share),
        excess(bottom_right, bottom_left + photographed(p + vec2i(2, 1)), top_right + photographed(p + vec2i(1, 2)), share),
        t.x,
    );
    return mix(top, bottom, t.y);
}

fn project(pos_camera: vec3f) -> vec2f {
    return unwrap.center + unwrap.focal * vec2f(pos_camera.x, -pos_camera.y) / max(-pos_camera.z, 1e-6);
}

/// How well the camera sees a point, past all that may hide it.
fn view_of(point: vec3f) -> f32 {
    let margin = SOFT_PIXELS * max(-point.z, 0.0) / unwrap.focal.x;
    var view = inside_frame(project(point));
    for (var i = 0u; i < arrayLength(&blockers); i++) {
        view *= 1.0 - hidden_share(blockers[i], margin, point);
    }
    return view;
}

/// What the picture itself shows of the things that lie in a direction from the ball; a: how well.
fn surroundings_from(dir: vec3f) -> vec4f {
    let ball = unwrap.ball;
    var nearest = 1e6;
    for (var i = 0u; i < arrayLength(&surroundings); i++) {
        let span = inside_of(surroundings[i], vec3f(1.0), ball.center_camera, dir);
        if span.x > 0.0 && span.x <= span.y {
            nearest = min(nearest, span.x);
        }
    }
    // By direction only where nothing is known to lie there: a point far away.
    let point = ball.center_camera + dir * min(nearest, 1e3);
    if point.z > -1e-3 {
        return vec4f(0.0);
    }
    let pixel = project(point);
    var view = inside_frame(pixel) * unwrap.has_solids;
    // Beside the ball's outline: the sine of the angle between the two, in pixels.
    let to_ball = normalize(ball.center_camera);
    let beside = length(cross(normalize(point), to_ball)) - ball.radius / length(ball.center_camera);
    view *= clamp(beside * unwrap.focal.x / SOFT_PIXELS - 0.5, 0.0, 1.0);
    for (var i = 0u; i < arrayLength(&surroundings); i++) {
        let span = inside_of(surroundings[i], vec3f(1.0), vec3f(0.0), point);
        // Something else, or the far side of the same thing.
        view *= select(1.0, 0.0, span.x <= span.y && span.y > 0.0 && max(span.x, 0.0) < 0.98);
    }
    return vec4f(sample_frame(pixel, vec3f(1.0), SMOOTH), view);
}

fn seen_from(face: u32, p: vec2f, step: f32) -> Seen {
    let ball = unwrap.ball;
    let axis = -normalize(ball.center_camera);
    let dir_world = world_direction(face, p);
    let dir = unwrap.camera_from_world * dir_world;
    let side = side_of(axis, dir);
    let angle = angle_from(axis, dir);
    let theta = normal_angle(ball, min(angle, ball.edge_angle));
    let point = ball_point(ball, axis, side, theta);
    let pixel = project(point);
    let to_right = unwrap.camera_from_world * world_direction(face, p + vec2f(step, 0.0));
    let to_down = unwrap.camera_from_world * world_direction(face, p + vec2f(0.0, step));
    let theta_right = neighboring_normal_angle(ball, min(angle_from(axis, to_right), ball.edge_angle), theta);
    let theta_down = neighboring_normal_angle(ball, min(angle_from(axis, to_down), ball.edge_angle), theta);
    let texel = mat2x2f(
        project(ball_point(ball, axis, side_of(axis, to_right), theta_right)) - pixel,
        project(ball_point(ball, axis, side_of(axis, to_down), theta_down)) - pixel,
    );
    let gain = gain_from(dir_world, dir);
    var seen: Seen;
    let at_rim = smoothstep(ball.edge_angle - RIM.x, ball.edge_angle - RIM.y, angle);
    let sharpness = mix(SHARP_BALL, SMOOTH, at_rim);
    let mean = mean_of_frame(pixel, texel, gain, sharpness);
    // At most all of it is taken away and as much added: sensor noise in the dark stays small.
    seen.radiance = (mean + clamp(leaked(pixel, texel, sharpness), -mean, mean)) / ball.reflectance;
    seen.resolution = clamp(sqrt(abs(determinant(texel))), LEAST_CONFIDENCE, 1.0);
    seen.shown = view_of(point) * clamp((ball.edge_angle - angle) / RIM.y, 0.0, 1.0);
    // At the edge of what is shown the guess continues it; where the ball is covered or outside of the picture it is worth little.
    seen.guessed = view_of(point);
    if angle > ball.edge_angle {
        // Hidden: the mean of an arc of the rim, from its point on this side at the edge to the whole ring in the middle of the gap.
        let other = cross(axis, side);
        let rim_theta = normal_angle(ball, ball.edge_angle);
        let inward = clamp((angle - ball.edge_angle) / (PI - ball.edge_angle), 0.0, 1.0);
        var ring = vec4f(0.0);
        for (var i = 0u; i < RING; i++) {
            let azimuth = unit_vector(PI * inward * ((2.0 * f32(i) + 1.0) / f32(RING) - 1.0));
            let rim = ball_point(ball, axis, side * azimuth.x + other * azimuth.y, rim_theta);
            let weight = view_of(rim) + 1e-3;
            ring += vec4f(sample_frame(project(rim), gain, SMOOTH) / ball.reflectance, 1.0) * weight;
        }
        seen.radiance = ring.rgb / ring.w;
        seen.guessed = min(ring.w / f32(RING), 1.0);
    }
    if max(at_rim, 1.0 - seen.guessed) > 0.0 {
        let direct = surroundings_from(dir);
        let weight = direct.a * max(at_rim, 1.0 - seen.guessed);
        seen.radiance = mix(seen.radiance, direct.rgb, weight);
        seen.guessed = max(seen.guessed, weight);
    }
    return seen;
}
#else
#ifdef FISHEYE
/// Pixel that shows a direction (camera space). Twin of `lens.rs`.
fn picture_point(dir: vec3f) -> vec2f {
    let across = length(dir.xy);
    // Sine and tangent of half the angle θ from the axis: 2 cos²(θ/2) = 1 + cos θ.
    let twice_squared = max(1.0 - dir.z, 1e-6);
    let angle = angle_of(vec2f(-dir.z, across));
    let equisolid = min(across * inverseSqrt(0.5 * twice_squared), 2.0);
    let stereographic = 2.0 * min(across / twice_squared, STEEPEST_STEREOGRAPHIC);
    let radial = vec4f(angle, equisolid, stereographic, select(1.0, across, dir.z < 0.0));
    let side = vec2f(dir.x, -dir.y) / max(across, 1e-6);
    return unwrap.center + unwrap.focal * side * dot(radial, unwrap.lens);
}
/// Radians inside of the lens's field of view, per pixel.
fn shown_by_lens(dir: vec3f, pixel: vec2f) -> f32 {
    let inside = unwrap.half_fov - angle_of(vec2f(-dir.z, length(dir.xy)));
    let soft = SOFT_PIXELS * unwrap.half_fov / min(unwrap.focal.x, unwrap.focal.y);
    return clamp(inside / soft, 0.0, 1.0) * inside_frame(pixel);
}
#else ifdef EQUIRECT
/// Pixel that shows a direction: columns from −Z towards +X, rows from +Y down. Twin of `lens.rs`.
fn picture_point(dir: vec3f) -> vec2f {
    let azimuth = angle_of(vec2f(-dir.z, dir.x)) / (2.0 * PI);
    let polar = angle_of(vec2f(dir.y, length(dir.xz))) / PI;
    return unwrap.focal * vec2f(azimuth - floor(azimuth), polar);
}
fn shown_by_lens(dir: vec3f, pixel: vec2f) -> f32 {
    return 1.0;
}
#else
/// Pixel of an orthographic picture of a ball that shows a direction: the half vector (row A5). Twin of `lens.rs`.
fn picture_point(dir: vec3f) -> vec2f {
    let sum = dir + vec3f(0.0, 0.0, unwrap.wrap);
    let half_vector = sum / max(length(sum), 1e-4);
    return unwrap.center + unwrap.focal * vec2f(half_vector.x, -half_vector.y);
}
fn shown_by_lens(dir: vec3f, pixel: vec2f) -> f32 {
    let from_middle = length((pixel - unwrap.center) / unwrap.focal);
    let sum = dir.z + unwrap.wrap;
    let inside = (1.0 - from_middle) * min(unwrap.focal.x, unwrap.focal.y) / SOFT_PIXELS;
    return clamp(inside + 0.5, 0.0, 1.0) * inside_frame(pixel) * select(0.0, 1.0, sum > 0.0);
}
#endif

fn seen_from(face: u32, p: vec2f, step: f32) -> Seen {
    let dir_world = world_direction(face, p);
    let dir = unwrap.camera_from_world * dir_world;
    let pixel = picture_point(dir);
    var right = picture_point(unwrap.camera_from_world * world_direction(face, p + vec2f(step, 0.0))) - pixel;
    var down = picture_point(unwrap.camera_from_world * world_direction(face, p + vec2f(0.0, step))) - pixel;
#ifdef EQUIRECT
    // The shorter way around.
    right.x -= unwrap.focal.x * round(right.x / unwrap.focal.x);
    down.x -= unwrap.focal.x * round(down.x / unwrap.focal.x);
#endif
    var seen: Seen;
    let texel = mat2x2f(right, down);
    seen.radiance = mean_of_frame(pixel, texel, gain_from(dir_world, dir), SHARP);
    seen.resolution = clamp(sqrt(abs(determinant(texel))), LEAST_CONFIDENCE, 1.0);
    seen.shown = shown_by_lens(dir, pixel);
    seen.guessed = 0.0;
    return seen;
}
#endif

@compute @workgroup_size(8, 8, 1)
fn unwrap_picture(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(cube);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    let step = 2.0 / f32(size.x);
    var seen = seen_from(id.z, (vec2f(id.xy) + 0.5) * step - 1.0, step);
    // Selects, no branches: software Vulkan compiles a shader that branches on a uniform anew for every dispatch.
    let is_uniform = unwrap.gain.w > 0.5;
    seen.radiance = min(select(seen.radiance, unwrap.uniform_radiance, is_uniform), vec3f(MAX_RADIANCE));
    seen.guessed = select(seen.guessed, 1.0, is_uniform);

    let held = textureLoad(history, id.xy, id.z, 0);
    let earlier = min(held.rgb * unwrap.history_scale, vec3f(MAX_RADIANCE));
    let kept = held.a * unwrap.history_keep;
    let confidence = max(seen.resolution * seen.shown * unwrap.confidence, unwrap.least_confidence);
    // What is seen now wins, unless it was seen much better not long ago and still looks like that.
    let difference = length(seen.radiance - earlier) / (length(seen.radiance + earlier) + 1e-4);
    let disagreement = smoothstep(0.05, 0.15, difference) * unwrap.history_is_old * seen.shown;
    let wins = smoothstep(0.4, 0.9, confidence / max(kept, 1e-6));
    let now = max(wins, disagreement);
    let measured = mix(earlier, seen.radiance, now);
    // Where nothing is seen: what was seen lately, else the guess, else whatever there is.
    let is_known = max(seen.shown, clamp(kept / USUAL_CONFIDENCE, 0.0, 1.0));
    let guess = mix(earlier, seen.radiance, select(seen.guessed, 1.0, held.a == 0.0));
    let radiance_now = mix(guess, measured, select(is_known, 0.0, is_uniform));
    let radiance = mix(held.rgb, radiance_now, select(unwrap.share, 1.0, held.a == 0.0));
    let trust = select(mix(kept, confidence, now), 0.0, is_uniform);
    textureStore(cube, id.xy, id.z, vec4f(radiance, max(trust, LEAST_CONFIDENCE)));
}
