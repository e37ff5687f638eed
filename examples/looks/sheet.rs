//! Parts of pictures side by side, each under its caption.

use crate::support::captions;
use bevy::math::{UVec2, Vec2};
use image::{Rgb, RgbImage, imageops};

/// Space between and around the strips, and height of a caption, as fractions of a strip's width.
const MARGIN: f32 = 0.0125;
const CAPTION: f32 = 0.05;
/// Width of a strip per pixel of a letter.
const LETTER: u32 = 270;
const PAPER: Rgb<u8> = Rgb([24, 24, 26]);
const INK: Rgb<u8> = Rgb([235, 235, 235]);
const DIM: Rgb<u8> = Rgb([150, 150, 155]);

/// Strips of pictures in columns.
pub(crate) struct Sheet {
    /// Upper left corner and size of the strip in a picture.
    corner: UVec2,
    strip: UVec2,
    columns: u32,
    margin: u32,
    caption: u32,
    pub picture: RgbImage,
}

impl Sheet {
    /// A sheet for some strips of pictures of a size. `part` has the corners of a strip, as fractions of that size.
    pub(crate) fn new(size: UVec2, part: [Vec2; 2], columns: u32, strips: u32) -> Self {
        let [corner, end] = part.map(|part| (part * size.as_vec2()).as_uvec2());
        let strip = (end - corner).max(UVec2::ONE);
        let [margin, caption] = [MARGIN, CAPTION].map(|part| (part * strip.x as f32).ceil() as u32);
        let cell = strip + UVec2::new(margin, margin + caption);
        let sheet = cell * UVec2::new(columns, strips.div_ceil(columns)) + margin;
        let picture = RgbImage::from_pixel(sheet.x, sheet.y, PAPER);
        Self { corner, strip, columns, margin, caption, picture }
    }

    /// Adds the strip number `i` of a picture. Its caption is the name, after a dim word if that is not empty.
    pub(crate) fn add(&mut self, i: u32, dim: &str, name: &str, whole: &RgbImage) {
        let strip = imageops::crop_imm(whole, self.corner.x, self.corner.y, self.strip.x, self.strip.y).to_image();
        let cell = self.strip + UVec2::new(self.margin, self.margin + self.caption);
        let at = self.margin + UVec2::new(i % self.columns, i / self.columns) * cell;
        imageops::replace(&mut self.picture, &strip, at.x.into(), (at.y + self.caption).into());
        let letter = self.strip.x / LETTER;
        if letter > 0 {
            let at = at + UVec2::new(letter, self.caption.saturating_sub(7 * letter) / 2);
            let at = captions::write(&mut self.picture, at, letter, DIM, dim);
            captions::write(&mut self.picture, at, letter, INK, &name.to_uppercase());
        }
    }
}
