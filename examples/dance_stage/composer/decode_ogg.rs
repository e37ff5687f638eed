//! Decoding of OGG Vorbis.

use super::{compose_error::ComposeError, decode::Mix};
use std::{
    fs::File,
    io::ErrorKind,
    panic::{AssertUnwindSafe, catch_unwind},
};
use symphonia::core::{
    codecs::audio::AudioDecoderOptions,
    errors::Error,
    formats::{FormatOptions, TrackType, probe::Hint},
    io::MediaSourceStream,
    meta::MetadataOptions,
};

/// A packet has fewer samples than this in each channel; a broken one may claim any number.
const MAX_PACKET: u64 = 1 << 16;

/// Decodes the first audio stream of a file.
///
/// A damaged packet becomes silence of the same length, as players do. A file most of which is damaged is an error.
pub(crate) fn decode_ogg<'a>(source: File, mix: Mix<'a>) -> Result<Mix<'a>, ComposeError> {
    let damaged = mix.damaged("its tables make no sense");
    // symphonia 0.6 asserts what tables of made-up files need not fulfil. Nothing outlives the panic but the error.
    catch_unwind(AssertUnwindSafe(|| decode_packets(source, mix))).unwrap_or(Err(damaged))
}

fn decode_packets(source: File, mut mix: Mix) -> Result<Mix, ComposeError> {
    let stream = MediaSourceStream::new(Box::new(source), Default::default());
    let mut format = symphonia::default::get_probe()
        .probe(&Hint::new(), stream, FormatOptions::default(), MetadataOptions::default())
        .map_err(|error| mix.unreadable(&error.to_string()))?;
    let track = format.default_track(TrackType::Audio).ok_or_else(|| mix.no_sound())?;
    let track_id = track.id;
    let parameters = track.codec_params.as_ref().and_then(|parameters| parameters.audio());
    // Gapless decoding believes the times that pages state and leaves out samples where they are wrong, as in files
    // that were joined, which moves all beats after that.
    let mut decoder = symphonia::default::get_codecs()
        .make_audio_decoder(parameters.ok_or_else(|| mix.no_sound())?, &AudioDecoderOptions::default().gapless(false))
        .map_err(|error| mix.unreadable(&error.to_string()))?;
    let mut interleaved: Vec<f32> = Vec::new();
    let [mut good, mut bad] = [0usize; 2];
    loop {
        let packet = match format.next_packet() {
            Ok(Some(packet)) => packet,
            // The file ends or was cut off, or another stream begins: what came before is the song.
            Ok(None) | Err(Error::ResetRequired) => break,
            Err(Error::IoError(error)) if error.kind() == ErrorKind::UnexpectedEof => break,
            Err(error) => return Err(mix.damaged(&error.to_string())),
        };
        if packet.track_id != track_id {
            continue;
        }
        match decoder.decode(&packet) {
            Ok(buffer) => {
                good += 1;
                mix.set_rate(buffer.spec().rate())?;
                let channels = buffer.num_planes();
                buffer.copy_to_vec_interleaved(&mut interleaved);
                // Players leave out the delay of the encoder at the beginning.
                let delay = if mix.is_empty() { packet.trim_start.get().min(MAX_PACKET) as usize } else { 0 };
                mix.add(interleaved.get(delay * channels..).unwrap_or_default(), channels)?;
            }
            Err(Error::DecodeError(_) | Error::IoError(_)) => {
                bad += 1;
                mix.add_silence(packet.dur.get().min(MAX_PACKET) as usize)?;
            }
            Err(error) => return Err(mix.damaged(&error.to_string())),
        }
    }
    if bad > good { Err(mix.damaged("most packets cannot be decoded")) } else { Ok(mix) }
}
