//! Where to step: the lane of each arrow.
//!
//! [`Step`]s enter, and notes leave. Feet alternate, so that no foot steps twice in a row, and neighboring arrows are
//! in different lanes. Each phrase begins on the home lane of its foot, which is Left or Right. Phrases of the same
//! music have the same pattern; every other time Up and Down are exchanged, and Left and Right so that the feet go on
//! alternating.

use super::{
    arrange::Step,
    levels::Level,
    slots::{SLOTS_PER_PHRASE, Slots},
};
use crate::random::Random;
use crate::song::Lane;

/// Weights of the lanes of a foot.
const HOME: f32 = 1.0;
const CENTER: f32 = 0.8;
/// Factor of a step back to where the foot was, so that feet do not stay in two lanes for long.
const BACK: f32 = 0.55;
/// Jumps and their weights.
const JUMPS: [([Lane; 2], f32); 6] = [
    ([Lane::Left, Lane::Right], 0.4),
    ([Lane::Left, Lane::Up], 0.15),
    ([Lane::Left, Lane::Down], 0.15),
    ([Lane::Up, Lane::Right], 0.15),
    ([Lane::Down, Lane::Right], 0.15),
    ([Lane::Down, Lane::Up], 0.1),
];
/// Factor of a jump onto the lane of the step before.
const ONTO_LAST: f32 = 0.3;
#[derive(Clone, Copy, PartialEq, Eq)]
enum Foot {
    Left,
    Right,
}

impl Foot {
    fn other(self) -> Self {
        if self == Self::Left { Self::Right } else { Self::Left }
    }

    fn home(self) -> Lane {
        if self == Self::Left { Lane::Left } else { Lane::Right }
    }
}

/// Arrows of a step: a lane, and another one for a jump.
pub(crate) type Lanes = (Lane, Option<Lane>);

/// Sets the lanes of steps, in the same order.
pub(crate) fn lanes(steps: &[Step], song: &Slots, level: &Level, seed: u64) -> Vec<Lanes> {
    let mut lanes = Vec::with_capacity(steps.len());
    let mut foot = Foot::Left;
    let mut repetitions = vec![0; song.same_as.len()];
    for steps in steps.chunk_by(|a, b| a.slot / SLOTS_PER_PHRASE == b.slot / SLOTS_PER_PHRASE) {
        let music = song.same_as[steps[0].slot / SLOTS_PER_PHRASE];
        let pattern = pattern(steps, level, &mut Random::for_purpose(seed, music as u64));
        let is_flipped = repetitions[music] % 2 == 1;
        repetitions[music] += 1;
        let place = |lane: Lane| match lane {
            Lane::Left | Lane::Right if foot == Foot::Left => lane,
            Lane::Left => Lane::Right,
            Lane::Right => Lane::Left,
            Lane::Up if is_flipped => Lane::Down,
            Lane::Down if is_flipped => Lane::Up,
            lane => lane,
        };
        lanes.extend(pattern.into_iter().map(|(lane, other)| (place(lane), other.map(place))));
        if steps.iter().filter(|step| !step.is_jump).count() % 2 == 1 {
            foot = foot.other();
        }
    }
    lanes
}

/// Pattern of a phrase that begins with the left foot.
fn pattern(steps: &[Step], level: &Level, random: &mut Random) -> Vec<Lanes> {
    let mut lanes: Vec<Lanes> = Vec::with_capacity(steps.len());
    let mut foot = Foot::Left;
    // Where each foot stands.
    let mut stands: [Option<Lane>; 2] = [None; 2];
    let mut last: Option<Lane> = None;
    for (i, step) in steps.iter().enumerate() {
        if step.is_jump {
            let weigh = |(pair, weight): ([Lane; 2], f32)| {
                (pair, if last.is_some_and(|last| pair.contains(&last)) { ONTO_LAST * weight } else { weight })
            };
            let [left, right] = random.choose(&JUMPS.map(weigh)).unwrap_or([Lane::Left, Lane::Right]);
            stands = [Some(left), Some(right)];
            last = None;
            lanes.push((left, Some(right)));
            continue;
        }
        let home = foot.home();
        let lane = if lanes.is_empty() {
            home
        } else {
            // The next phrase begins at home, so no foot may be on the other's side at the end.
            let crossover = if i + 1 < steps.len() { level.crossover } else { 0.0 };
            let [own, others] = [stands[foot as usize], stands[foot.other() as usize]];
            let weigh = |lane: Lane| {
                let base = match lane {
                    lane if Some(lane) == last || Some(lane) == others => 0.0,
                    lane if lane == home => HOME,
                    Lane::Up | Lane::Down => CENTER,
                    _ => crossover,
                };
                let is_candle = matches!((own, lane), (Some(Lane::Up), Lane::Down) | (Some(Lane::Down), Lane::Up));
                base * if is_candle { level.candle } else { 1.0 } * if own == Some(lane) { BACK } else { 1.0 }
            };
            random.choose(&Lane::ALL.map(|lane| (lane, weigh(lane)))).unwrap_or(home)
        };
        stands[foot as usize] = Some(lane);
        last = Some(lane);
        foot = foot.other();
        lanes.push((lane, None));
    }
    lanes
}
