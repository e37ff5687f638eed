//! The sound of a metronome, as a WAV file in memory.

/// Samples per second. A click needs no high notes.
const RATE: u32 = 8000;
/// Frequency of a click, in hertz, and the time in which it fades to a third, in seconds.
const PITCH: f64 = 1500.0;
const DECAY: f64 = 0.008;
const VOLUME: f64 = 0.6;

/// A click at the beginning and then every `period` seconds, for `seconds`: mono, 16 bits.
pub(crate) fn click_track(period: f64, seconds: f64) -> Vec<u8> {
    let samples = (f64::from(RATE) * seconds) as u32;
    let bytes = 2 * samples;
    let mut wav = Vec::with_capacity(44 + bytes as usize);
    // The header of a PCM file (Microsoft and IBM, Multimedia Programming Interface and Data Specifications, 1991).
    wav.extend(b"RIFF");
    wav.extend((36 + bytes).to_le_bytes());
    wav.extend(b"WAVEfmt ");
    wav.extend(16_u32.to_le_bytes());
    wav.extend([1_u16, 1].map(u16::to_le_bytes).concat());
    wav.extend([RATE, 2 * RATE].map(u32::to_le_bytes).concat());
    wav.extend([2_u16, 16].map(u16::to_le_bytes).concat());
    wav.extend(b"data");
    wav.extend(bytes.to_le_bytes());
    for sample in 0..samples {
        let age = (f64::from(sample) / f64::from(RATE)).rem_euclid(period);
        let value = VOLUME * (std::f64::consts::TAU * PITCH * age).sin() * (-age / DECAY).exp();
        wav.extend(((value * f64::from(i16::MAX)) as i16).to_le_bytes());
    }
    wav
}
