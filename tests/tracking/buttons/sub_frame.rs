//! Times of steps between two frames, from coverages that are given.

use super::field_state::FieldState;

const FRAME: f64 = 1.0 / 30.0;
/// Rounding of coverages, in seconds.
const TOLERANCE: f64 = 1e-6;

#[test]
fn coverage_that_grows_evenly_crosses_at_the_same_time_wherever_frames_fall() {
    // Coverage grows by 1 per second from 1 s on, so the first crossing does not depend on the phase of the frames, as
    // long as the frame before already shows some of it.
    let crossing = |phase: f64| {
        let mut state = FieldState::default();
        (0..60).find_map(|frame| {
            let seconds = f64::from(frame) * FRAME + phase;
            state.update(Some((seconds - 1.0).clamp(0.0, 1.0) as f32), seconds)
        })
    };
    let first = crossing(0.0).expect("is covered in the end");
    assert!(first.is_covered);
    for phase in [0.005, 0.011, 0.017, 0.029] {
        let change = crossing(phase).expect("is covered in the end");
        assert!((change.at_seconds - first.at_seconds).abs() < TOLERANCE, "{phase}: {change:?}, {first:?}");
    }
}

#[test]
fn steps_come_in_the_frame_that_shows_them_and_never_lie_in_its_future() {
    let mut state = FieldState::default();
    assert_eq!(state.update(Some(0.0), 0.0), None);
    let press = state.update(Some(0.5), FRAME).expect("no frame later");
    assert!(press.is_covered && press.at_seconds > 0.0 && press.at_seconds <= FRAME, "{press:?}");
    assert_eq!((state.is_covered(), state.coverage()), (Some(true), Some(0.5)));
    let release = state.update(Some(0.0), 2.0 * FRAME).expect("no frame later");
    assert!(!release.is_covered && release.at_seconds > FRAME && release.at_seconds <= 2.0 * FRAME, "{release:?}");
}

#[test]
fn frames_that_cannot_tell_hold_the_state_and_bound_how_far_back_a_step_lies() {
    let mut state = FieldState::default();
    state.update(Some(0.0), 0.0);
    for frame in 1..300 {
        assert_eq!(state.update(None, f64::from(frame) * FRAME), None);
    }
    assert_eq!(state.is_covered(), Some(false));
    let press = state.update(Some(0.9), 10.0).expect("is covered");
    assert!(press.at_seconds >= 9.9 && press.at_seconds <= 10.0, "{press:?}");
}
