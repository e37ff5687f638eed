//! All methods in one picture, with the cost and the error of each.

use crate::{
    Lab,
    method::{METHODS, Method},
    options::Options,
    picture::Picture,
    support::{Outcome, captions, rgb_image},
};
use bevy::prelude::*;
use bevy_mirrorball::shadows::{ShadowDomeLight, ShadowFilter, VisibilitySamples};
use image::{GenericImage, Rgb, RgbImage};
use std::{path::Path, time::Instant};

const COLUMNS: u32 = 3;
/// Height of the captions, and size of their letters' pixels.
const CAPTION: u32 = 44;
const LETTER: u32 = 2;
/// Frames in which the cars drive, whose median time counts.
const TIMED: usize = 25;
/// Frames in which nothing moves, so that all shadow maps are up to date.
const STILL: usize = 24;
const INK: Rgb<u8> = Rgb([230, 230, 225]);
const PAPER: Rgb<u8> = Rgb([24, 26, 30]);

/// What the methods are compared with: as many directions and samples as a dome can have.
fn truth(lab: &Lab) -> Lab {
    let dome = ShadowDomeLight {
        directions: ShadowDomeLight::MAX_DIRECTIONS,
        refreshed_per_frame: ShadowDomeLight::MAX_DIRECTIONS,
        samples: VisibilitySamples::Full,
        filter: ShadowFilter::Bilinear,
        ..lab.dome.clone()
    };
    Lab { method: Method::Dome, dome, ..lab.clone() }
}

pub(crate) fn draw(options: &Options, file: &Path) -> Outcome<()> {
    // Light that bounces is no shadow, and only the dome has it.
    let dome = ShadowDomeLight { surfels: 0, ..options.dome.clone() };
    let lab = Lab::new(options.method, &dome);
    let size = options.size;
    let mut still = Picture::new(truth(&lab), size)?;
    // All its maps are drawn at once.
    let truth = still.draw()?;
    drop(still);
    let mut shown = Vec::new();
    for (name, method) in METHODS {
        let mut picture = Picture::new(Lab { method, ..lab.clone() }, size)?;
        let pixels = picture.settled()?;
        let mut times = Vec::new();
        for _ in 0..TIMED {
            let started = Instant::now();
            picture.draw_step()?;
            times.push(started.elapsed().as_secs_f64() * 1e3);
        }
        times.sort_by(f64::total_cmp);
        shown.push((name, difference(&pixels, &truth), times[TIMED / 2], pixels));
    }
    let without = shown.iter().find(|(name, ..)| *name == "none").map_or(0.0, |(_, _, time, _)| *time);
    let cell = size + UVec2::new(0, CAPTION);
    let cells = shown.len() as u32 + 1;
    let mut sheet = RgbImage::from_pixel(COLUMNS * cell.x, cells.div_ceil(COLUMNS) * cell.y, PAPER);
    let mut add = |at: u32, pixels: &[u8], lines: [&str; 2]| -> Outcome<()> {
        let corner = UVec2::new(at % COLUMNS, at / COLUMNS) * cell;
        sheet.copy_from(&rgb_image(size, pixels)?, corner.x, corner.y)?;
        for (line, y) in lines.into_iter().zip([4, 24]) {
            captions::write(&mut sheet, corner + UVec2::new(8, size.y + y), LETTER, INK, &line.to_uppercase());
        }
        Ok(())
    };
    add(0, &truth, ["truth", &format!("dome of {} directions", ShadowDomeLight::MAX_DIRECTIONS)])?;
    for (at, (name, error, time, pixels)) in (1..).zip(&shown) {
        let cost = time - without;
        println!("{name}: {cost:.1} ms more than without shadows, error {:.2} %", 100.0 * error);
        add(at, pixels, [name, &format!("cost {cost:.1} ms   error {:.1} %", 100.0 * error)])?;
    }
    sheet.save(file).map_err(|error| format!("cannot write {}: {error}", file.display()))?;
    println!("shadow_lab: all methods in {}", file.display());
    Ok(())
}

impl Picture {
    /// Returns the picture once all shadows are up to date.
    fn settled(&mut self) -> Outcome<Vec<u8>> {
        for _ in 0..STILL {
            self.app.update();
        }
        self.draw()
    }
}

/// Root mean square difference of two pictures, as a fraction of white.
fn difference(a: &[u8], b: &[u8]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
    (squares / a.len().max(1) as f64).sqrt() / 255.0
}
