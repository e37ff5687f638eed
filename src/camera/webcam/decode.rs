//! Decoding of camera frames to RGBA.
//!
//! The conversions are plain functions of this crate. Generic functions of a library would be compiled without
//! optimization into a game's debug build, and take 40 times as long.

use super::{
    format::{DecodeError, PixelFormat, RawFrame},
    jpeg,
};
use crate::camera::FramePixels;
use bevy::prelude::*;

/// Decodes a frame to 8-bit sRGB. Alpha is 255.
pub(super) fn decode(raw: &RawFrame) -> Result<FramePixels, DecodeError> {
    if raw.bytes.is_empty() || raw.size.min_element() == 0 {
        return Err(DecodeError::Empty);
    }
    if raw.format == PixelFormat::Mjpeg {
        return jpeg::decode(raw.bytes, raw.size);
    }
    let (width, height) = (raw.size.x as usize, raw.size.y as usize);
    let row_bytes = raw.format.row_bytes(raw.size.x);
    let stride = raw.stride.max(row_bytes);
    let rows = if raw.format == PixelFormat::Nv12 { height + height.div_ceil(2) } else { height };
    // The padding after the last row may be missing.
    let expected = stride * rows.saturating_sub(1) + row_bytes;
    if raw.bytes.len() < expected {
        return Err(DecodeError::Short { expected, got: raw.bytes.len() });
    }
    let mut rgba = vec![0; 4 * width * height];
    let rows_out = rgba.chunks_exact_mut(4 * width);
    if raw.format == PixelFormat::Nv12 {
        let (luma, chroma) = raw.bytes.split_at(stride * height);
        for (y, row) in rows_out.enumerate() {
            nv12_row(&luma[stride * y..][..width], &chroma[stride * (y / 2)..][..row_bytes], row);
        }
    } else {
        let convert = match raw.format {
            PixelFormat::Yuyv => yuyv_row,
            PixelFormat::Rgb => rgb_row,
            PixelFormat::Bgr => bgr_row,
            _ => gray_row,
        };
        for (row_in, row) in raw.bytes.chunks(stride).zip(rows_out) {
            convert(&row_in[..row_bytes], row);
        }
    }
    FramePixels::new(raw.size, rgba).ok_or(DecodeError::Empty)
}

/// Conversion of `Y'CbCr` of limited range to R'G'B' of full range, ITU-R BT.601-7 §2.5: Y' has 219 steps from 16, Cb
/// and Cr have 224 steps around 128. In 16-bit fixed point: 1.164383 (Y'−16), 1.596027 Cr, −0.391762 Cb − 0.812968 Cr,
/// 2.017232 Cb.
struct Chroma {
    red: i32,
    green: i32,
    blue: i32,
}

impl Chroma {
    #[inline]
    fn new(cb: u8, cr: u8) -> Self {
        let (cb, cr) = (i32::from(cb) - 128, i32::from(cr) - 128);
        Self { red: 104_597 * cr, green: -25_675 * cb - 53_279 * cr, blue: 132_201 * cb }
    }

    #[inline]
    fn with_luma(&self, y: u8) -> [u8; 4] {
        const HALF: i32 = 1 << 15;
        let luma = 76_309 * (i32::from(y) - 16) + HALF;
        let byte = |value: i32| ((luma + value) >> 16).clamp(0, 255) as u8;
        [byte(self.red), byte(self.green), byte(self.blue), 255]
    }
}

fn yuyv_row(row_in: &[u8], row: &mut [u8]) {
    let (pairs, last) = row.as_chunks_mut::<8>();
    let (pairs_in, _) = row_in.as_chunks::<4>();
    for (&[y0, cb, y1, cr], out) in pairs_in.iter().zip(&mut *pairs) {
        let chroma = Chroma::new(cb, cr);
        let ([r0, g0, b0, a0], [r1, g1, b1, a1]) = (chroma.with_luma(y0), chroma.with_luma(y1));
        *out = [r0, g0, b0, a0, r1, g1, b1, a1];
    }
    // With an odd width, the second pixel of the last pair lies outside the image.
    if let (Some(&[y0, cb, _, cr]), false) = (pairs_in.last(), last.is_empty()) {
        last.copy_from_slice(&Chroma::new(cb, cr).with_luma(y0));
    }
}

fn nv12_row(luma: &[u8], chroma: &[u8], row: &mut [u8]) {
    let (pairs, last) = row.as_chunks_mut::<8>();
    let (luma, last_luma) = luma.as_chunks::<2>();
    let (chroma, _) = chroma.as_chunks::<2>();
    for ((&[y0, y1], &[cb, cr]), out) in luma.iter().zip(chroma).zip(pairs) {
        let chroma = Chroma::new(cb, cr);
        let ([r0, g0, b0, a0], [r1, g1, b1, a1]) = (chroma.with_luma(y0), chroma.with_luma(y1));
        *out = [r0, g0, b0, a0, r1, g1, b1, a1];
    }
    if let (&[y], Some(&[cb, cr])) = (last_luma, chroma.last()) {
        last.copy_from_slice(&Chroma::new(cb, cr).with_luma(y));
    }
}

fn rgb_row(row_in: &[u8], row: &mut [u8]) {
    for (p, out) in row_in.as_chunks::<3>().0.iter().zip(row.as_chunks_mut::<4>().0) {
        *out = [p[0], p[1], p[2], 255];
    }
}

fn bgr_row(row_in: &[u8], row: &mut [u8]) {
    for (p, out) in row_in.as_chunks::<3>().0.iter().zip(row.as_chunks_mut::<4>().0) {
        *out = [p[2], p[1], p[0], 255];
    }
}

fn gray_row(row_in: &[u8], row: &mut [u8]) {
    for (&y, out) in row_in.iter().zip(row.as_chunks_mut::<4>().0) {
        *out = [y, y, y, 255];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(format: PixelFormat, size: (u32, u32), stride: usize, bytes: &[u8]) -> Result<Vec<u8>, DecodeError> {
        decode(&RawFrame { bytes, format, size: size.into(), stride }).map(|pixels| pixels.rgba)
    }

    /// Limited-range BT.601 codes of black, white and the saturated primaries, from the standard's formulas, and the
    /// full-range colors that they stand for. Rounding to codes costs up to two steps in the primaries.
    const COLORS: [([u8; 3], [u8; 3]); 6] = [
        ([16, 128, 128], [0, 0, 0]),
        ([235, 128, 128], [255, 255, 255]),
        ([126, 128, 128], [128, 128, 128]),
        ([81, 90, 240], [254, 0, 0]),
        ([145, 54, 34], [0, 255, 1]),
        ([41, 240, 110], [0, 0, 255]),
    ];

    #[test]
    fn yuyv_gives_the_colors_of_the_standard() {
        for ([y, cb, cr], [r, g, b]) in COLORS {
            let rgba = decoded(PixelFormat::Yuyv, (2, 1), 4, &[y, cb, y, cr]).unwrap();
            assert_eq!(rgba, [r, g, b, 255, r, g, b, 255], "{y} {cb} {cr}");
        }
    }

    #[test]
    fn codes_beyond_the_limited_range_are_clamped() {
        assert_eq!(decoded(PixelFormat::Yuyv, (2, 1), 4, &[0, 128, 255, 128]).unwrap()[..5], [0, 0, 0, 255, 255]);
    }

    #[test]
    fn nv12_shares_one_chroma_between_two_by_two_pixels() {
        let ([y, cb, cr], [r, g, b]) = COLORS[3];
        let bytes = [y, y, 16, 16, y, y, 16, 16, cb, cr, 128, 128];
        let rgba = decoded(PixelFormat::Nv12, (4, 2), 4, &bytes).unwrap();
        for row in rgba.chunks(16) {
            assert_eq!(row, [r, g, b, 255, r, g, b, 255, 0, 0, 0, 255, 0, 0, 0, 255]);
        }
    }

    #[test]
    fn rgb_bgr_and_gray_are_copied() {
        assert_eq!(decoded(PixelFormat::Rgb, (1, 1), 3, &[1, 2, 3]).unwrap(), [1, 2, 3, 255]);
        assert_eq!(decoded(PixelFormat::Bgr, (1, 1), 3, &[1, 2, 3]).unwrap(), [3, 2, 1, 255]);
        assert_eq!(decoded(PixelFormat::Gray, (2, 1), 2, &[7, 9]).unwrap(), [7, 7, 7, 255, 9, 9, 9, 255]);
    }

    #[test]
    fn row_padding_is_skipped_and_the_last_row_needs_none() {
        let bytes = [1, 2, 99, 99, 3, 4];
        assert_eq!(decoded(PixelFormat::Gray, (2, 2), 4, &bytes).unwrap()[8..12], [3, 3, 3, 255]);
        let padded = [16, 128, 235, 128, 0, 0, 235, 128, 16, 128];
        let rgba = decoded(PixelFormat::Yuyv, (2, 2), 6, &padded).unwrap();
        assert_eq!((rgba[0], rgba[4], rgba[8], rgba[12]), (0, 255, 255, 0));
        let nv12 = [235, 235, 9, 235, 235, 9, 128, 128];
        assert_eq!(decoded(PixelFormat::Nv12, (2, 2), 3, &nv12).unwrap(), [255; 16]);
    }

    #[test]
    fn odd_sizes_are_decoded_to_the_edge() {
        let yuyv = [16, 128, 16, 128, 235, 128, 0, 128];
        assert_eq!(decoded(PixelFormat::Yuyv, (3, 1), 8, &yuyv).unwrap()[8..], [255; 4]);
        let nv12 = [235, 235, 16, 0].repeat(3).into_iter().chain([128; 8]).collect::<Vec<_>>();
        let rgba = decoded(PixelFormat::Nv12, (3, 3), 4, &nv12).unwrap();
        assert_eq!(rgba[24..], [255, 255, 255, 255, 255, 255, 255, 255, 0, 0, 0, 255]);
    }

    #[test]
    fn empty_and_truncated_frames_are_refused() {
        assert_eq!(decoded(PixelFormat::Yuyv, (2, 2), 4, &[]), Err(DecodeError::Empty));
        assert_eq!(decoded(PixelFormat::Mjpeg, (2, 2), 0, &[]), Err(DecodeError::Empty));
        let short = Err(DecodeError::Short { expected: 8, got: 7 });
        assert_eq!(decoded(PixelFormat::Yuyv, (2, 2), 4, &[0; 7]), short);
        assert_eq!(decoded(PixelFormat::Nv12, (2, 2), 2, &[0; 5]), Err(DecodeError::Short { expected: 6, got: 5 }));
        assert_eq!(decoded(PixelFormat::Rgb, (0, 0), 0, &[0]), Err(DecodeError::Empty));
    }
}
