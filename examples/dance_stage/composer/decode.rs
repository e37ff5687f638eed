//! Decoding of OGG Vorbis and WAV files.
//!
//! A file enters, and mono samples between about −1 and 1 leave, with the sample rate in hertz. Sample 0 is the first
//! that a player plays, so that times in the samples are times of the song. A file that was cut off is the song up to
//! there.

use super::{
    compose_error::{ComposeError, MAX_MINUTES, MAX_RATE, MIN_RATE},
    decode_ogg::decode_ogg,
    decode_wav::decode_wav,
};
use std::{
    fs::File,
    io::{Read, Seek},
    path::Path,
};

/// Sound of a song, mono.
pub(crate) struct Sound {
    /// All channels, averaged.
    pub samples: Vec<f32>,
    /// Samples per second.
    pub rate: u32,
}

impl Sound {
    pub(crate) fn seconds(&self) -> f64 {
        self.samples.len() as f64 / f64::from(self.rate.max(1))
    }
}

/// Decodes a file. What it is shows in its first bytes; its name does not matter.
pub(crate) fn decode(file: &Path) -> Result<Sound, ComposeError> {
    let cannot_open = |source| ComposeError::Open { file: file.into(), source };
    let mut source = File::open(file).map_err(cannot_open)?;
    let mut magic = Vec::new();
    (&mut source).take(4).read_to_end(&mut magic).map_err(cannot_open)?;
    source.rewind().map_err(cannot_open)?;
    let mix = Mix::new(file);
    let mix = match magic.as_slice() {
        b"OggS" => decode_ogg(source, mix),
        b"RIFF" => decode_wav(source, mix),
        _ => Err(mix.unreadable("its first bytes are those of another kind of file")),
    }?;
    mix.finish()
}

/// Samples decoded so far, and what can be wrong with them.
pub(crate) struct Mix<'a> {
    file: &'a Path,
    samples: Vec<f32>,
    rate: u32,
}

impl<'a> Mix<'a> {
    fn new(file: &'a Path) -> Self {
        Self { file, samples: Vec::new(), rate: 0 }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Sets the sample rate, before anything is added.
    pub(crate) fn set_rate(&mut self, rate: u32) -> Result<(), ComposeError> {
        self.rate = rate;
        let is_good = (MIN_RATE..=MAX_RATE).contains(&rate);
        if is_good { Ok(()) } else { Err(ComposeError::Rate { file: self.file.into(), rate }) }
    }

    /// Adds the mean of interleaved channels.
    pub(crate) fn add(&mut self, interleaved: &[f32], channels: usize) -> Result<(), ComposeError> {
        let weight = 1.0 / channels.max(1) as f32;
        let average = |frame: &[f32]| {
            let mean = frame.iter().sum::<f32>() * weight;
            // Float files can hold anything.
            if mean.is_finite() { mean.clamp(-4.0, 4.0) } else { 0.0 }
        };
        self.samples.extend(interleaved.chunks_exact(channels.max(1)).map(average));
        self.check_length()
    }

    /// Adds silence in place of what is damaged.
    pub(crate) fn add_silence(&mut self, frames: usize) -> Result<(), ComposeError> {
        self.samples.resize(self.samples.len() + frames, 0.0);
        self.check_length()
    }

    fn check_length(&self) -> Result<(), ComposeError> {
        let most = self.rate as usize * 60 * MAX_MINUTES as usize;
        if self.samples.len() > most { Err(ComposeError::TooLong { file: self.file.into() }) } else { Ok(()) }
    }

    pub(crate) fn unreadable(&self, reason: &str) -> ComposeError {
        ComposeError::Format { file: self.file.into(), reason: reason.to_owned() }
    }

    pub(crate) fn no_sound(&self) -> ComposeError {
        ComposeError::NoSound { file: self.file.into() }
    }

    pub(crate) fn damaged(&self, reason: &str) -> ComposeError {
        let seconds = self.samples.len() as f64 / f64::from(self.rate.max(1));
        ComposeError::Damaged { file: self.file.into(), seconds, reason: reason.to_owned() }
    }

    fn finish(self) -> Result<Sound, ComposeError> {
        if self.samples.is_empty() {
            return Err(self.no_sound());
        }
        Ok(Sound { samples: self.samples, rate: self.rate })
    }
}
