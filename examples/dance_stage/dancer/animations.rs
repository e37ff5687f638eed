//! Which animation of a glTF file is which move.

use super::choreography::Move;
use crate::song::Lane;

/// Names of moves that figures of others have, in lower case. Any part of a name counts, the first kind that exists is
/// taken.
const IDLE: &[&str] = &["dance", "idle", "survey", "stand"];
const STEP: &[&str] = &["step", "walk", "run"];
const JUMP: &[&str] = &["jump", "hop"];
const SPIN: &[&str] = &["spin", "turn"];
const CHEER: &[&str] = &["cheer", "wave", "thumbs", "victory"];
const STUMBLE: &[&str] = &["stumble", "fall", "trip"];
const LEFT: &[&str] = &["left"];
const RIGHT: &[&str] = &["right"];

/// Beats in a second, at which the animations of others have the length that they are made with.
const BEATS_PER_SECOND: f32 = 2.0;

/// An animation that is danced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MoveAnimation {
    /// Number among the names.
    pub index: usize,
    /// Whether it is made for this game: a second of it is a beat.
    pub is_native: bool,
}

/// Whether a file is made for this game: it has an animation with the name of a step.
pub(crate) fn is_native(names: &[&str]) -> bool {
    Lane::ALL.iter().any(|lane| names.contains(&Move::Step(*lane).name()))
}

/// Returns the animation of a move. Files that are made for this game name it exactly; of others, the idle animation is
/// the first one if no name says more.
pub(crate) fn of_move(what: Move, names: &[&str]) -> Option<MoveAnimation> {
    if is_native(names) {
        let index = names.iter().position(|name| *name == what.name())?;
        return Some(MoveAnimation { index, is_native: true });
    }
    let lower: Vec<_> = names.iter().map(|name| name.to_lowercase()).collect();
    let find = |parts: &[&str]| parts.iter().find_map(|part| lower.iter().position(|name| name.contains(part)));
    let index = match what {
        Move::Idle => find(IDLE).or((!names.is_empty()).then_some(0)),
        // As a mirror image, too.
        Move::Step(Lane::Left) => find(RIGHT).or_else(|| find(STEP)),
        Move::Step(Lane::Right) => find(LEFT).or_else(|| find(STEP)),
        Move::Step(_) => find(STEP),
        Move::Jump => find(JUMP),
        Move::Spin => find(SPIN),
        Move::Cheer => find(CHEER),
        Move::Stumble => find(STUMBLE),
    }?;
    Some(MoveAnimation { index, is_native: false })
}

/// Second of an animation of some length in seconds, `beats` after its move began, at a beat of the song. Moves that
/// are repeated keep about their own pace and fit whole beats.
pub(crate) fn second(what: Move, is_native: bool, seconds: f32, beats: f32, beat: f64) -> f32 {
    let is_repeated = matches!(what, Move::Idle | Move::Cheer);
    match (is_native, is_repeated) {
        (true, _) => beats,
        (false, true) => {
            let round = (seconds * BEATS_PER_SECOND).round().max(1.0);
            seconds * (beat.rem_euclid(round.into()) as f32 / round)
        }
        (false, false) => seconds * (beats / what.beats() as f32).clamp(0.0, 1.0),
    }
}
