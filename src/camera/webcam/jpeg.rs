//! Decoding of Motion-JPEG frames to RGBA.
//!
//! Most decoders fill the missing parts of damaged JPEGs with gray or old rows. That suits viewers and falsifies
//! measurements, so that damaged frames are rejected here: those without an end mark, and those on which the decoder's
//! strict mode fails.

use super::format::DecodeError;
use crate::camera::FramePixels;
use bevy::prelude::*;
use std::borrow::Cow;
use zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions};
use zune_jpeg::JpegDecoder;

/// Decodes a JPEG, which must have the given size.
pub(super) fn decode(bytes: &[u8], size: UVec2) -> Result<FramePixels, DecodeError> {
    let damaged = |what: &str| DecodeError::Jpeg(what.to_owned());
    let layout = Layout::find(bytes).ok_or_else(|| damaged("it has no picture in it"))?;
    let scan_end = layout.scan_end.ok_or_else(|| damaged("it is cut off"))?;
    // The end mark is cut off: if it comes too early, the decoder would silently continue in gray. The decoder reports
    // missing bytes once per row of blocks, so that a gap that begins in the last row stays undetected.
    let jpeg = with_huffman_tables(&bytes[..scan_end], layout.has_huffman_tables);
    let options = DecoderOptions::new_fast()
        .set_strict_mode(true)
        .set_max_width(size.x as usize)
        .set_max_height(size.y as usize)
        .jpeg_set_out_colorspace(ColorSpace::RGBA);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(&*jpeg), options);
    decoder.decode_headers().map_err(|error| damaged(&error.to_string()))?;
    if decoder.dimensions() != Some((size.x as usize, size.y as usize)) {
        return Err(damaged("it has another size than the camera said"));
    }
    let is_gray = decoder.input_colorspace() == Some(ColorSpace::Luma);
    if is_gray {
        decoder.set_options(options.jpeg_set_out_colorspace(ColorSpace::Luma));
    }
    let mut pixels = decoder.decode().map_err(|error| damaged(&error.to_string()))?;
    if is_gray {
        pixels = pixels.iter().flat_map(|&y| [y, y, y, 255]).collect();
    }
    FramePixels::new(size, pixels).ok_or_else(|| damaged("pixels are missing"))
}

/// Positions of the parts of a JPEG that matter here.
#[derive(Debug, PartialEq, Eq)]
struct Layout {
    has_huffman_tables: bool,
    /// Position of the end mark; `None` if the JPEG is cut off.
    scan_end: Option<usize>,
}

impl Layout {
    /// Walks over the segments (ITU-T T.81, annex B) up to the start of the scan. The end mark cannot occur within a
    /// scan, but it can occur in a thumbnail in an earlier segment, and some cameras fill the buffer behind it with
    /// garbage.
    fn find(bytes: &[u8]) -> Option<Self> {
        const START_OF_SCAN: u8 = 0xDA;
        const HUFFMAN_TABLES: u8 = 0xC4;
        let mut at = bytes.starts_with(&[0xFF, 0xD8]).then_some(2)?;
        let mut has_huffman_tables = false;
        loop {
            let &[0xFF, marker] = bytes.get(at..at + 2)? else {
                return None;
            };
            if marker == 0xFF {
                at += 1;
                continue;
            }
            has_huffman_tables |= marker == HUFFMAN_TABLES;
            let length = u16::from_be_bytes([*bytes.get(at + 2)?, *bytes.get(at + 3)?]);
            at += 2 + usize::from(length);
            if marker == START_OF_SCAN {
                let scan = bytes.get(at..)?;
                let scan_end = scan.windows(2).position(|pair| pair == [0xFF, 0xD9]).map(|offset| at + offset);
                return Some(Self { has_huffman_tables, scan_end });
            }
        }
    }
}

/// Returns the JPEG with an `AVI1` segment if its Huffman tables are missing. Many webcams omit them, as Motion-JPEG in
/// AVI containers does, and mean the tables of T.81 annex K. The decoder inserts those where it finds an `AVI1`
/// segment.
fn with_huffman_tables(bytes: &[u8], has_them: bool) -> Cow<'_, [u8]> {
    const AVI1: [u8; 11] = [0xFF, 0xE0, 0, 9, b'A', b'V', b'I', b'1', 0, 0, 0];
    if has_them {
        return Cow::Borrowed(bytes);
    }
    Cow::Owned([&bytes[..2], &AVI1, &bytes[2..]].concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;

    const SIZE: UVec2 = UVec2::new(64, 48);
    /// Largest error, in steps of 255, of compression at this quality on a smooth image.
    const MAX_JPEG_ERROR: u8 = 6;

    /// A smooth image: red increases to the right, green downward.
    fn sample() -> Vec<u8> {
        let image = image::RgbImage::from_fn(SIZE.x, SIZE.y, |x, y| image::Rgb([4 * x as u8, 5 * y as u8, 90]));
        let mut jpeg = Vec::new();
        JpegEncoder::new_with_quality(&mut jpeg, 95).encode_image(&image).unwrap();
        jpeg
    }

    #[test]
    fn a_whole_image_comes_out_as_it_was() {
        let pixels = decode(&sample(), SIZE).unwrap();
        for (x, y) in [(0, 0), (63, 0), (0, 47), (40, 20)] {
            let is = pixels.rgb8(x, y);
            let was = [4 * x as u8, 5 * y as u8, 90];
            assert!(is.iter().zip(was).all(|(a, b)| a.abs_diff(b) <= MAX_JPEG_ERROR), "{is:?} {was:?}");
        }
        assert!(pixels.rgba.chunks(4).all(|pixel| pixel[3] == 255));
    }

    #[test]
    fn an_image_cut_anywhere_is_refused() {
        let jpeg = sample();
        for length in 0..jpeg.len() {
            assert!(decode(&jpeg[..length], SIZE).is_err(), "{length} of {}", jpeg.len());
        }
    }

    #[test]
    fn an_image_that_ends_too_early_is_refused_even_with_its_end_mark() {
        let jpeg = sample();
        let mut cut = jpeg[..jpeg.len() - jpeg.len() / 4].to_vec();
        cut.extend([0xFF, 0xD9]);
        assert!(matches!(decode(&cut, SIZE), Err(DecodeError::Jpeg(_))));
    }

    #[test]
    fn rubbish_and_other_sizes_are_refused_without_a_panic() {
        for byte in [0, 0x55, 0xFF] {
            assert!(decode(&vec![byte; 5000], SIZE).is_err());
        }
        assert!(decode(&sample(), UVec2::new(64, 40)).is_err());
        assert!(decode(&sample(), UVec2::new(640, 480)).is_err());
    }

    #[test]
    fn damaged_bytes_are_no_panic() {
        let jpeg = sample();
        let mut random = 1_u64;
        for _ in 0..500 {
            let mut bytes = jpeg.clone();
            for _ in 0..4 {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let at = (random >> 33) as usize % bytes.len();
                bytes[at] = (random >> 20) as u8;
            }
            if let Ok(pixels) = decode(&bytes, SIZE) {
                assert_eq!(pixels.size, SIZE);
            }
        }
    }

    #[test]
    fn rubbish_behind_the_end_mark_does_no_harm() {
        let mut jpeg = sample();
        jpeg.extend([0; 100]);
        jpeg.extend([0xFF, 0xD8, 0x12]);
        assert_eq!(decode(&jpeg, SIZE).unwrap().rgba, decode(&sample(), SIZE).unwrap().rgba);
    }

    #[test]
    fn gray_jpegs_are_gray() {
        let image = image::GrayImage::from_pixel(SIZE.x, SIZE.y, image::Luma([77]));
        let mut jpeg = Vec::new();
        JpegEncoder::new(&mut jpeg).encode_image(&image).unwrap();
        assert!(decode(&jpeg, SIZE).unwrap().rgba.chunks(4).all(|pixel| pixel == [77, 77, 77, 255]));
    }

    #[test]
    fn the_standard_huffman_tables_are_meant_where_none_are_given() {
        let jpeg = sample();
        let mut without = jpeg[..2].to_vec();
        let mut at = 2;
        while jpeg[at + 1] != 0xDA {
            let next = at + 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
            if jpeg[at + 1] != 0xC4 {
                without.extend(&jpeg[at..next]);
            }
            at = next;
        }
        without.extend(&jpeg[at..]);
        assert!(without.len() + 400 < jpeg.len());
        assert_eq!(decode(&without, SIZE).unwrap().rgba, decode(&jpeg, SIZE).unwrap().rgba);
    }
}
