// Temporal accumulation: an observation merged into the history of the cube.

#define_import_path bevy_mirrorball::unwrap::history

#import bevy_mirrorball::unwrap::bindings::{history, unwrap}
#import bevy_mirrorball::unwrap::observation::{MIN_CONFIDENCE, Observation}

/// Upper limit of the radiance stored; below the 65504 of half floats, so that sums of a few texels still fit.
const MAX_RADIANCE: f32 = 60000.0;
/// Confidence from which the history counts fully where nothing is visible now: a fifth of that in the center of a ball
/// 50 pixels wide.
const FULL_CONFIDENCE: f32 = 0.03;

/// New content of a texel of the cube; alpha: confidence.
fn merged(observed: Observation, texel: vec2u, face: u32) -> vec4f {
    var seen = observed;
    // Selects instead of branches: software Vulkan recompiles a shader that branches on a uniform for every dispatch.
    let is_uniform = unwrap.gain.w > 0.5;
    seen.radiance = min(select(seen.radiance, unwrap.uniform_radiance, is_uniform), vec3f(MAX_RADIANCE));
    seen.guess_quality = select(seen.guess_quality, 1.0, is_uniform);

    let held = textureLoad(history, texel, face, 0);
    let earlier = min(held.rgb * unwrap.history_scale, vec3f(MAX_RADIANCE));
    let kept = held.a * unwrap.history_keep;
    let confidence = max(seen.resolution * seen.visibility * unwrap.confidence, unwrap.min_confidence);
    // The observation wins, unless the history saw the direction much better not long ago and still agrees with it.
    let difference = length(seen.radiance - earlier) / (length(seen.radiance + earlier) + 1e-4);
    let disagreement = smoothstep(0.05, 0.15, difference) * unwrap.history_is_old * seen.visibility;
    let wins = smoothstep(0.4, 0.9, confidence / max(kept, 1e-6));
    let now = max(wins, disagreement);
    let measured = mix(earlier, seen.radiance, now);
    // A direction that is not visible keeps the recent history, else gets the guess, else keeps what there is.
    let is_known = max(seen.visibility, clamp(kept / FULL_CONFIDENCE, 0.0, 1.0));
    let guess = mix(earlier, seen.radiance, select(seen.guess_quality, 1.0, held.a == 0.0));
    let radiance_now = mix(guess, measured, select(is_known, 0.0, is_uniform));
    let radiance = mix(held.rgb, radiance_now, select(unwrap.weight, 1.0, held.a == 0.0));
    let trust = select(mix(kept, confidence, now), 0.0, is_uniform);
    return vec4f(radiance, max(trust, MIN_CONFIDENCE));
}
