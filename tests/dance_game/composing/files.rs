//! Files of all kinds: good ones are read, and bad ones have an error that says what to do.

use crate::{
    composer::{compose_file, decode},
    composing::synthetic_track::Track,
    composing::ten_tracks::rock,
    song::Simfile,
};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// File in the folder for temporary files, removed at the end.
struct TemporaryFile(PathBuf);

impl TemporaryFile {
    fn new(name: &str, content: &[u8]) -> Self {
        let file = std::env::temp_dir().join(format!("composer_{}_{name}", std::process::id()));
        fs::write(&file, content).expect("the folder for temporary files can be written");
        Self(file)
    }
}

impl Drop for TemporaryFile {
    fn drop(&mut self) {
        // A file that is gone already is no concern of the test.
        let _gone = fs::remove_file(&self.0);
    }
}

/// WAV file of 16-bit samples in two channels, the second of which is silent.
fn wav(samples: &[f32], rate: u32) -> Vec<u8> {
    let data: Vec<u8> =
        samples.iter().flat_map(|sample| [(sample * 16_000.0) as i16, 0]).flat_map(i16::to_le_bytes).collect();
    let mut file = Vec::new();
    file.extend_from_slice(b"RIFF");
    file.extend_from_slice(&(36 + data.len() as u32).to_le_bytes());
    file.extend_from_slice(b"WAVEfmt ");
    file.extend_from_slice(&16u32.to_le_bytes());
    for field in [1u16, 2] {
        file.extend_from_slice(&field.to_le_bytes());
    }
    file.extend_from_slice(&rate.to_le_bytes());
    file.extend_from_slice(&(4 * rate).to_le_bytes());
    for field in [4u16, 16] {
        file.extend_from_slice(&field.to_le_bytes());
    }
    file.extend_from_slice(b"data");
    file.extend_from_slice(&(data.len() as u32).to_le_bytes());
    file.extend_from_slice(&data);
    file
}

fn error_of(name: &str, content: &[u8]) -> String {
    let file = TemporaryFile::new(name, content);
    let error = decode(&file.0).map(|_| ()).expect_err("the file is no song").to_string();
    assert!(error.contains(&*file.0.to_string_lossy()), "{error} does not name the file");
    error
}

#[test]
fn a_wav_file_is_read_sample_by_sample() {
    let track = rock(Track::with_tempo(44_100, 2.0, 0.1, 120.0));
    let samples = track.sound().samples;
    let file = TemporaryFile::new("good.wav", &wav(&samples, 44_100));
    let sound = decode(&file.0).expect("the file is good");
    assert_eq!((sound.rate, sound.samples.len()), (44_100, samples.len()));
    // Half of it is the silent channel; 16 bits are exact to 1/32768.
    for (read, written) in sound.samples.iter().zip(&samples) {
        assert!((read - 0.5 * written * 16_000.0 / 32_768.0).abs() < 1.0 / 32_768.0, "{read} for {written}");
    }
}

#[test]
fn a_file_becomes_a_song_that_can_be_written_and_read() {
    let track = rock(Track::with_tempo(44_100, 20.0, 0.1, 120.0));
    let file = TemporaryFile::new("my_song.wav", &wav(&track.sound().samples, 44_100));
    let song = compose_file(&file.0, 1).expect("the song has a beat");
    assert!(song.title.ends_with("my song"), "{}", song.title);
    assert!(song.music.ends_with("my_song.wav"), "{}", song.music);
    let read = Simfile::parse(&song.to_sm()).expect("what was written can be read");
    assert_eq!(read.charts, song.charts);
    let beats = (0..40).map(f64::from);
    let error = beats.map(|beat| (read.timing.seconds_at(beat) - song.timing.seconds_at(beat)).abs());
    assert!(error.fold(0.0, f64::max) < 0.001);
}

#[test]
fn bad_files_have_errors_with_a_remedy() {
    let error = decode(Path::new("no_such_song.ogg")).map(|_| ()).expect_err("there is none").to_string();
    assert!(error.starts_with("cannot open no_such_song.ogg") && error.contains("check the path"), "{error}");
    assert!(error_of("empty.ogg", b"").contains("convert it"));
    assert!(error_of("text.ogg", b"This is a text and not a song, however long it is.").contains("convert it"));
    assert!(error_of("silent.wav", &wav(&[], 44_100)).contains("no sound in it"));
    assert!(error_of("slow.wav", &wav(&[0.5; 4_000], 4_000)).contains("4000 samples a second"));
}

#[test]
fn damaged_files_never_panic() {
    let good = wav(&rock(Track::with_tempo(8_000, 2.0, 0.1, 120.0)).sound().samples, 8_000);
    for cut in (0..200).chain([good.len() / 2, good.len() - 1]) {
        let file = TemporaryFile::new("cut.wav", &good[..cut]);
        // Either is right; what counts is that it returns.
        let _either = decode(&file.0);
    }
    for flipped in 0..44 * 8 {
        let mut bad = good.clone();
        bad[flipped / 8] ^= 1 << (flipped % 8);
        let file = TemporaryFile::new("flipped.wav", &bad);
        let _either = decode(&file.0);
    }
}
