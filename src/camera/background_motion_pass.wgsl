// Motion vectors where the background shows the camera frame and nothing else is drawn: at depth 0, which is where this
// triangle lies.

/// Twin of `WITHOUT_HISTORY` in `background_motion_pass.rs`.
const WITHOUT_HISTORY: vec2f = vec2f(8.0);

@fragment
fn fragment() -> @location(0) vec2f {
    return WITHOUT_HISTORY;
}
