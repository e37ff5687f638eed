//! When to step: the slots that get an arrow, a jump or a hold.
//!
//! What sounds at each quarter beat enters, with the limits of a difficulty, and [`Step`]s leave. Each measure has as
//! many as it is busy, the strongest onsets first, so verses and choruses differ, and silence has none. Off the beat
//! there is an arrow only where a sound begins; on the beat also where it is merely felt, between sounds.

use super::{
    levels::{Level, Quota},
    slots::{SLOTS_PER_BEAT, SLOTS_PER_MEASURE, SLOTS_PER_PHRASE, Slot, Slots},
};
use std::collections::BTreeSet;

/// Moment at which the dancer steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    /// Number of the slot, counted from beat 0.
    pub slot: usize,
    /// With both feet.
    pub is_jump: bool,
    /// How long to hold, in slots.
    pub hold: Option<usize>,
}

/// Loudness below this fraction of the loud slots is silence.
const SILENCE: f32 = 0.03;
/// A beat is felt up to this many slots from an onset on either side.
const FELT_SLOTS: usize = 2 * SLOTS_PER_BEAT;
/// Quantile of what counts as loud and as busy.
const HIGH_QUANTILE: f64 = 0.9;
/// Activity that counts as quiet, as a fraction of busy.
const QUIET: f32 = 0.35;
/// Least time in seconds from a jump to its neighbors.
const JUMP_GAP: f64 = 0.22;
/// Least salience of a jump.
const JUMP_SALIENCE: f32 = 0.8;
/// Shortest rest after a note that may be held, and longest hold, in slots.
const HOLD_REST: usize = 6;
const MAX_HOLD: usize = 2 * SLOTS_PER_BEAT;
/// Slots between the end of a hold and the next arrow.
const HOLD_RELEASE: usize = 2;
/// What is held stays this loud, against how loud it began.
const SUSTAIN: f32 = 0.35;
/// Onsets within a hold are weaker than what is held by this factor.
const HELD_CONTRAST: f32 = 0.6;
/// A long note is this strong, and onsets in it are weaker by this factor.
const LONG_NOTE_SALIENCE: f32 = 0.7;
const LONG_NOTE_CONTRAST: f32 = 0.3;

/// Chooses the steps of one difficulty.
pub(crate) fn arrange(song: &Slots, level: &Level) -> Vec<Step> {
    let slots = &song.slots;
    let busyness = busyness(song);
    let mut chosen = choose(slots, &busyness, level);
    if level.has_holds {
        clear_long_notes(slots, &mut chosen);
    }
    let jumps = jumps(slots, &busyness, level, &chosen);
    let order: Vec<usize> = chosen.into_iter().collect();
    let mut steps = Vec::with_capacity(order.len());
    for (i, slot) in order.iter().copied().enumerate() {
        let is_jump = jumps.contains(&slot);
        let next = order.get(i + 1).copied().unwrap_or(slots.len());
        let hold = if level.has_holds && !is_jump { hold(slots, slot, next) } else { None };
        steps.push(Step { slot, is_jump, hold });
    }
    steps
}

/// How busy each measure is, from 0 to 1, by its onsets and its loudness.
fn busyness(song: &Slots) -> Vec<f32> {
    let loudness: Vec<f32> = song.slots.chunks(SLOTS_PER_PHRASE).map(mean_loudness).collect();
    let activity: Vec<f32> = song
        .slots
        .chunks(SLOTS_PER_MEASURE)
        .enumerate()
        .map(|(measure, slots)| {
            let onsets: f32 = slots.iter().map(Slot::salience).sum();
            // Repeated phrases are as busy as the first, so that they have the same steps.
            let phrase = song.same_as[measure * SLOTS_PER_MEASURE / SLOTS_PER_PHRASE];
            onsets * loudness[phrase].sqrt()
        })
        .collect();
    let busy = quantile(&activity).max(f32::MIN_POSITIVE);
    activity.into_iter().map(|activity| ((activity / busy - QUIET) / (1.0 - QUIET)).clamp(0.0, 1.0)).collect()
}

fn mean_loudness(slots: &[Slot]) -> f32 {
    slots.iter().map(|slot| slot.loudness).sum::<f32>() / slots.len().max(1) as f32
}

fn quantile(values: &[f32]) -> f32 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f32::total_cmp);
    let rank = (sorted.len().saturating_sub(1) as f64 * HIGH_QUANTILE) as usize;
    sorted.get(rank).copied().unwrap_or(0.0)
}

/// Slots with an arrow.
fn choose(slots: &[Slot], busyness: &[f32], level: &Level) -> BTreeSet<usize> {
    let silence = SILENCE * quantile(&slots.iter().map(|slot| slot.loudness).collect::<Vec<_>>());
    let priority = |slot: &usize| slots[*slot].salience() + meter_weight(*slot);
    let mut candidates = Vec::new();
    for (measure, busy) in busyness.iter().enumerate() {
        let start = measure * SLOTS_PER_MEASURE;
        for (quota, places) in [(&level.beats, &[0][..]), (&level.half_beats, &[2]), (&level.quarter_beats, &[1, 3])] {
            let mut fitting: Vec<usize> = (start..(start + SLOTS_PER_MEASURE).min(slots.len()))
                .filter(|slot| places.contains(&(slot % SLOTS_PER_BEAT)))
                .filter(|slot| slots[*slot].loudness > silence && is_heard(slots, *slot, quota))
                .collect();
            fitting.sort_by(|a, b| priority(b).total_cmp(&priority(a)));
            let count = quota.count[0] + busy * (quota.count[1] - quota.count[0]);
            candidates.extend(fitting.into_iter().take(count.round() as usize));
        }
    }
    // The strongest first; what is too near to a stronger one goes.
    candidates.sort_by(|a, b| priority(b).total_cmp(&priority(a)));
    let mut chosen: BTreeSet<usize> = BTreeSet::new();
    for slot in candidates {
        let is_apart = |other: Option<&usize>| {
            other.is_none_or(|other| (slots[*other].seconds - slots[slot].seconds).abs() >= level.min_gap)
        };
        if is_apart(chosen.range(..slot).next_back()) && is_apart(chosen.range(slot..).next()) {
            chosen.insert(slot);
        }
    }
    chosen
}

/// Weight of a place in the measure: the first beat before the third, and beats before what is between.
fn meter_weight(slot: usize) -> f32 {
    match slot % SLOTS_PER_MEASURE {
        0 => 0.6,
        8 => 0.45,
        4 | 12 => 0.3,
        place if place % 2 == 0 => 0.1,
        _ => 0.0,
    }
}

/// Whether a sound begins in a slot, or, if that is not asked for, the beat is felt there.
fn is_heard(slots: &[Slot], slot: usize, quota: &Quota) -> bool {
    if quota.min_salience > 0.0 {
        return slots[slot].salience() >= quota.min_salience;
    }
    let begins = |slots: &[Slot]| slots.iter().any(|slot| slot.salience() > 0.0);
    begins(&slots[slot.saturating_sub(FELT_SLOTS)..=slot])
        && begins(&slots[slot..(slot + FELT_SLOTS + 1).min(slots.len())])
}

/// Removes weak arrows within notes that are long enough to be held.
fn clear_long_notes(slots: &[Slot], chosen: &mut BTreeSet<usize>) {
    for slot in chosen.clone() {
        let salience = slots[slot].salience();
        let within = slot + 1..(slot + HOLD_REST).min(slots.len());
        let is_long = salience >= LONG_NOTE_SALIENCE
            && slots[within.clone()].iter().all(|other| other.salience() < LONG_NOTE_CONTRAST * salience)
            && is_sustained(slots, slot, within.end);
        if is_long && chosen.contains(&slot) {
            chosen.retain(|other| !within.contains(other));
        }
    }
}

/// Slots with a jump: the accents of each phrase.
fn jumps(slots: &[Slot], busyness: &[f32], level: &Level, chosen: &BTreeSet<usize>) -> BTreeSet<usize> {
    let mut jumps = BTreeSet::new();
    let accent = |slot: &usize| slots[*slot].salience() + 0.5 * meter_weight(*slot);
    let is_apart = |slot: usize| {
        let far = |other: Option<&usize>| {
            other.is_none_or(|other| (slots[*other].seconds - slots[slot].seconds).abs() >= JUMP_GAP)
        };
        far(chosen.range(..slot).next_back()) && far(chosen.range(slot + 1..).next())
    };
    for (phrase, measures) in busyness.chunks(SLOTS_PER_PHRASE / SLOTS_PER_MEASURE).enumerate() {
        let range = phrase * SLOTS_PER_PHRASE..(phrase + 1) * SLOTS_PER_PHRASE;
        let on_beats = chosen.range(range).copied().filter(|slot| slot % SLOTS_PER_BEAT == 0 && is_apart(*slot));
        let mut accents: Vec<usize> = on_beats.filter(|slot| slots[*slot].salience() >= JUMP_SALIENCE).collect();
        accents.sort_by(|a, b| accent(b).total_cmp(&accent(a)));
        let busy = measures.iter().sum::<f32>() / measures.len() as f32;
        let count = (busy * level.jumps).round() as usize;
        for slot in accents {
            let taken = jumps.range(slot.saturating_sub(SLOTS_PER_MEASURE - 1)..slot + SLOTS_PER_MEASURE).count();
            if taken == 0 && jumps.range(phrase * SLOTS_PER_PHRASE..).count() < count {
                jumps.insert(slot);
            }
        }
    }
    jumps
}

/// Length of the hold of a slot, if what begins there goes on until shortly before the next arrow.
fn hold(slots: &[Slot], slot: usize, next: usize) -> Option<usize> {
    let rest = next - slot;
    if rest < HOLD_REST {
        return None;
    }
    let length = (rest - HOLD_RELEASE).min(MAX_HOLD) / 2 * 2;
    let begins = slots[slot].salience();
    let is_alone = slots[slot + 1..slot + length].iter().all(|other| other.salience() < HELD_CONTRAST * begins);
    let is_held = begins > 0.0 && is_alone && is_sustained(slots, slot, slot + length);
    is_held.then_some(length)
}

fn is_sustained(slots: &[Slot], start: usize, end: usize) -> bool {
    let loudness = slots[start].loudness;
    slots[start..end.min(slots.len())].iter().all(|slot| slot.loudness >= SUSTAIN * loudness)
}
