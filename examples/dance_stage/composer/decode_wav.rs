//! Decoding of WAV files: whole numbers of 8 to 32 bits, and floats of 32.

use super::{compose_error::ComposeError, decode::Mix};
use hound::{SampleFormat, WavReader};
use std::{fs::File, io::BufReader};

/// Frames that are decoded at once.
const BLOCK: usize = 4096;

/// Decodes a file. The samples up to where it is damaged or cut off are the song.
pub(crate) fn decode_wav<'a>(source: File, mut mix: Mix<'a>) -> Result<Mix<'a>, ComposeError> {
    let mut reader = WavReader::new(BufReader::new(source)).map_err(|error| mix.unreadable(&error.to_string()))?;
    let spec = reader.spec();
    mix.set_rate(spec.sample_rate)?;
    let channels = usize::from(spec.channels.max(1));
    match spec.sample_format {
        SampleFormat::Float => add_all(&mut mix, reader.samples::<f32>().map_while(Result::ok), channels)?,
        SampleFormat::Int => {
            let scale = 0.5f32.powi(i32::from(spec.bits_per_sample) - 1);
            let samples = reader.samples::<i32>().map_while(Result::ok);
            add_all(&mut mix, samples.map(|sample| scale * sample as f32), channels)?;
        }
    }
    Ok(mix)
}

fn add_all(mix: &mut Mix, mut samples: impl Iterator<Item = f32>, channels: usize) -> Result<(), ComposeError> {
    loop {
        let block: Vec<f32> = samples.by_ref().take(BLOCK * channels).collect();
        if block.is_empty() {
            return Ok(());
        }
        mix.add(&block, channels)?;
    }
}
