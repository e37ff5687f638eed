//! Inputs that failed once, cut down to what matters.

use super::{corpus, folder, read_environment, read_sidecar};
use bevy_mirrorball::environment_map::EquirectPixels;

#[test]
fn a_block_that_a_decoder_panics_on_is_an_error() {
    // In B44 a block of 14 bytes whose differences go below 0: the decoder subtracts without a check.
    let (name, mut bytes) = corpus::b44();
    let end = bytes.len();
    bytes[end - 14..].copy_from_slice(&[0, 0, 0x30, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
    let path = folder("cases").join(name);
    std::fs::write(&path, bytes).expect("the target folder is writable");
    read_environment(&path);
    if let Err(error) = EquirectPixels::open(&path) {
        assert!(error.to_string().contains("damaged"), "{error}");
    }
}

#[test]
fn many_stars_in_a_pattern_are_no_hang() {
    let folder = folder("stars");
    std::fs::write(folder.join("frame_0000000000000000000000000000000001.jpg"), b"not read").expect("writable");
    let pattern = "*0".repeat(30);
    let sidecar = format!(r#"{{"image": [8, 6], "fps": 10, "pattern": "{pattern}*2.jpg"}}"#);
    let path = folder.join("clip.json");
    std::fs::write(&path, sidecar).expect("writable");
    read_sidecar(&path);
}
