//! What sounds at each quarter of a beat.
//!
//! Onsets and a tempo map enter. What leaves is a [`Slot`] for each quarter beat, which an arrow can stand in, and for
//! each phrase of four measures the earlier one that it repeats.

use super::{measures::BEATS_PER_MEASURE, onsets::Onset, spectrum::Spectra, tempo_map::TempoMap};

pub(crate) const SLOTS_PER_BEAT: usize = 4;
pub(crate) const SLOTS_PER_MEASURE: usize = BEATS_PER_MEASURE * SLOTS_PER_BEAT;
pub(crate) const SLOTS_PER_PHRASE: usize = 4 * SLOTS_PER_MEASURE;
/// An onset this near to a slot in seconds is in it.
const REACH: f64 = 0.030;
/// The same as a fraction of the distance between slots, for fast songs.
const RELATIVE_REACH: f64 = 0.35;
/// Phrases this much alike are the same music.
const SAME: f32 = 0.8;
/// Loudness of two phrases of the same music differs less than this factor.
const SAME_LOUDNESS: f32 = 1.4;

/// Quarter of a beat.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Slot {
    /// When it is, in seconds.
    pub seconds: f64,
    /// Strength of the onset in it, 1 for the strong onsets of the song and 0 for none.
    pub onset: f32,
    /// The same for the bass.
    pub bass: f32,
    /// Root mean square amplitude until the next slot, relative to the song's.
    pub loudness: f32,
}

impl Slot {
    /// How much a listener notices what begins, from 0 to 1.5: a bass drum is in few bands and yet loud.
    pub(crate) fn salience(&self) -> f32 {
        self.onset.min(1.0) + 0.5 * self.bass.min(1.0)
    }
}

/// Slots of a song from beat 0 to its end, in whole phrases.
pub(crate) struct Slots {
    pub slots: Vec<Slot>,
    /// For each phrase, the first phrase with the same music: itself if there is none before.
    pub same_as: Vec<usize>,
}

impl Slots {
    pub(crate) fn of(map: &TempoMap, onsets: &[Onset], spectra: &Spectra) -> Self {
        let beats = map.beat_at(spectra.seconds(spectra.frames() as f64)).max(0.0);
        let phrases = (beats * SLOTS_PER_BEAT as f64 / SLOTS_PER_PHRASE as f64).ceil() as usize;
        let mut slots: Vec<Slot> = (0..phrases * SLOTS_PER_PHRASE)
            .map(|slot| {
                let seconds = map.seconds_at(slot as f64 / SLOTS_PER_BEAT as f64);
                let next = map.seconds_at((slot + 1) as f64 / SLOTS_PER_BEAT as f64);
                Slot { seconds, loudness: mean_loudness(spectra, seconds, next), ..Slot::default() }
            })
            .collect();
        for onset in onsets {
            let slot = (map.beat_at(onset.seconds) * SLOTS_PER_BEAT as f64).round();
            let next = map.seconds_at((slot + 1.0) / SLOTS_PER_BEAT as f64);
            let seconds = map.seconds_at(slot / SLOTS_PER_BEAT as f64);
            let reach = REACH.min(RELATIVE_REACH * (next - seconds));
            if slot < 0.0 || (onset.seconds - seconds).abs() > reach {
                continue;
            }
            if let Some(slot) = slots.get_mut(slot as usize) {
                slot.onset = slot.onset.max(onset.strength);
                slot.bass = slot.bass.max(onset.bass);
            }
        }
        let same_as = repetitions(&slots);
        Self { slots: averaged(slots, &same_as), same_as }
    }
}

fn mean_loudness(spectra: &Spectra, start: f64, end: f64) -> f32 {
    let frame = |seconds: f64| (spectra.frame_at(seconds).max(0.0) as usize).min(spectra.frames());
    let frames = &spectra.loudness[frame(start)..frame(end)];
    (frames.iter().map(|loudness| loudness * loudness).sum::<f32>() / frames.len().max(1) as f32).sqrt()
}

fn repetitions(slots: &[Slot]) -> Vec<usize> {
    let phrases: Vec<&[Slot]> = slots.chunks(SLOTS_PER_PHRASE).collect();
    let mut same_as: Vec<usize> = Vec::new();
    for (phrase, slots) in phrases.iter().enumerate() {
        let earlier = (0..phrase).find(|earlier| same_as[*earlier] == *earlier && are_alike(phrases[*earlier], slots));
        same_as.push(earlier.unwrap_or(phrase));
    }
    same_as
}

/// Whether two phrases have the same onsets and are about as loud.
fn are_alike(a: &[Slot], b: &[Slot]) -> bool {
    let features = |slots: &[Slot]| -> Vec<f32> {
        let values: Vec<f32> = slots.iter().flat_map(|slot| [slot.onset.min(1.0), slot.bass.min(1.0)]).collect();
        let mean = values.iter().sum::<f32>() / values.len().max(1) as f32;
        values.into_iter().map(|value| value - mean).collect()
    };
    let (a_features, b_features) = (features(a), features(b));
    let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
    let norms = product(&a_features, &a_features) * product(&b_features, &b_features);
    let loudness = |slots: &[Slot]| slots.iter().map(|slot| slot.loudness).sum::<f32>() + f32::MIN_POSITIVE;
    let ratio = loudness(a) / loudness(b);
    product(&a_features, &b_features) > SAME * norms.sqrt() && ratio.max(1.0 / ratio) < SAME_LOUDNESS
}

/// Gives all phrases of the same music the mean of their onsets, so that their arrows are the same, too.
fn averaged(mut slots: Vec<Slot>, same_as: &[usize]) -> Vec<Slot> {
    let original = slots.clone();
    for (first, _) in same_as.iter().enumerate().filter(|(phrase, first)| phrase == *first) {
        let group: Vec<usize> = (first..same_as.len()).filter(|phrase| same_as[*phrase] == first).collect();
        for place in 0..SLOTS_PER_PHRASE {
            let mean = |value: fn(&Slot) -> f32| {
                let values = group.iter().map(|phrase| value(&original[phrase * SLOTS_PER_PHRASE + place]));
                values.sum::<f32>() / group.len() as f32
            };
            let (onset, bass) = (mean(|slot| slot.onset), mean(|slot| slot.bass));
            for phrase in &group {
                let slot = &mut slots[phrase * SLOTS_PER_PHRASE + place];
                (slot.onset, slot.bass) = (onset, bass);
            }
        }
    }
    slots
}
