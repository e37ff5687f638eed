//! All looks side by side: the things on the desk, once in each look, with its name.

use crate::{
    desk::{self, CLIP, STILL},
    look::{Look, Thing, ThingData, show},
    options::Options,
    presets,
    support::{Outcome, asset_path, captions, fits_device, has_loaded, headless_log, loading_error, rgb_image},
};
use bevy::prelude::*;
use bevy_mirrorball::{camera::Clip, environment_map::EnvironmentCube, headless, prelude::*};
use image::{Rgb, RgbImage, imageops};
use std::{path::Path, time::Duration};

/// Longest wait for assets and shaders that load in the background, and for shadow maps.
const MAX_WAIT: Duration = Duration::from_secs(120);
/// Number of frames after which a new style has reached the renderer, and the strongest light has taken over.
const SETTLING_FRAMES: u32 = 10;
const COLUMNS: u32 = 3;
/// Corners of the part of the picture that a strip of the gallery shows, as fractions of its size.
const STRIP: [Vec2; 2] = [Vec2::new(0.0, 0.265), Vec2::new(0.845, 0.93)];
/// Space between and around the strips, and height of a caption, as fractions of a strip's width.
const MARGIN: f32 = 0.0125;
const CAPTION: f32 = 0.05;
/// Width of a strip per pixel of a letter.
const LETTER: u32 = 270;
const PAPER: Rgb<u8> = Rgb([24, 24, 26]);
const INK: Rgb<u8> = Rgb([235, 235, 235]);
const DIM: Rgb<u8> = Rgb([150, 150, 155]);

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let looks = options.looks()?;
    let clip = Clip::open(asset_path(CLIP))?;
    let mut app = headless::build_app(headless::default_plugins(), |app| {
        app.add_plugins(headless_log());
        desk::build(app, looks);
    })?;
    fits_device(&app, options.size)?;
    let (picture, target) = headless::add_target(&mut app, options.size);
    let feed = CameraFeed::file(asset_path(STILL)).with_pace(FeedPace::Lockstep);
    app.world_mut().spawn((ArCamera { intrinsics: clip.intrinsics, ..default() }, feed, target));
    load(&mut app)?;

    let sheet = if options.is_gallery() {
        let mut sheet = Sheet::new(options.size, presets::NAMES.len() as u32);
        for (i, (name, look)) in (0..).zip(presets::all()) {
            let world = app.world_mut();
            let mut things = world.query_filtered::<ThingData, With<Thing>>();
            show(&mut things.query_mut(world), &look.for_all());
            sheet.add(i, name, &look, &draw(&mut app, options.size, &picture)?);
        }
        sheet.picture
    } else {
        draw(&mut app, options.size, &picture)?
    };
    sheet.save(&options.out).map_err(|error| format!("cannot write {}: {error}", options.out.display()))?;
    println!("looks: see {}", options.out.display());
    Ok(())
}

/// Waits for the scenes and for the light that is measured in the ball.
fn load(app: &mut App) -> Outcome<()> {
    headless::update_until(app, "loading the scenes", MAX_WAIT, has_loaded)?;
    let assets = app.world().resource::<AssetServer>().clone();
    let world = app.world_mut();
    for scene in world.query::<&WorldAssetRoot>().iter(world) {
        let file = scene.0.path().map(|path| Path::new("assets").join(path.path())).unwrap_or_default();
        if let Some(error) = loading_error(&assets, &scene.0, &file) {
            return Err(error.into());
        }
    }
    headless::update_until(app, "measuring the light in the ball", MAX_WAIT, |app| {
        let world = app.world_mut();
        let cube = world.query::<&EnvironmentCube>().iter(world).next().map(|cube| cube.0.clone());
        let texels = cube.and_then(|cube| headless::read_texture(app, &cube).ok());
        texels.is_some_and(|texels| texels.iter().any(|byte| *byte != 0))
    })?;
    Ok(())
}

/// Draws frames until the style has changed and all shadow maps are up to date, and returns the last one.
fn draw(app: &mut App, size: UVec2, picture: &Handle<Image>) -> Outcome<RgbImage> {
    for _ in 0..SETTLING_FRAMES {
        headless::update(app)?;
    }
    headless::settle(app)?;
    headless::update_until(app, "drawing all shadow maps", MAX_WAIT, |app| {
        let world = app.world_mut();
        !world.query::<&DomeState>().iter(world).any(|dome| dome.outdated > 0)
    })?;
    Ok(rgb_image(size, &headless::read_texture(app, picture)?)?)
}

/// Strips of pictures in columns, each under its caption.
struct Sheet {
    /// Upper left corner and size of the strip in a picture.
    corner: UVec2,
    strip: UVec2,
    margin: u32,
    caption: u32,
    picture: RgbImage,
}

impl Sheet {
    fn new(size: UVec2, strips: u32) -> Self {
        let [corner, end] = STRIP.map(|part| (part * size.as_vec2()).as_uvec2());
        let strip = (end - corner).max(UVec2::ONE);
        let [margin, caption] = [MARGIN, CAPTION].map(|part| (part * strip.x as f32).ceil() as u32);
        let cell = strip + UVec2::new(margin, margin + caption);
        let sheet = cell * UVec2::new(COLUMNS, strips.div_ceil(COLUMNS)) + margin;
        let picture = RgbImage::from_pixel(sheet.x, sheet.y, PAPER);
        Self { corner, strip, margin, caption, picture }
    }

    fn add(&mut self, i: u32, name: &str, look: &Look, whole: &RgbImage) {
        let strip = imageops::crop_imm(whole, self.corner.x, self.corner.y, self.strip.x, self.strip.y).to_image();
        let cell = self.strip + UVec2::new(self.margin, self.margin + self.caption);
        let at = self.margin + UVec2::new(i % COLUMNS, i / COLUMNS) * cell;
        imageops::replace(&mut self.picture, &strip, at.x.into(), (at.y + self.caption).into());
        let letter = self.strip.x / LETTER;
        if letter > 0 {
            let kind = match look.style {
                SurfaceStyle::Toon(_) if name != "toon" => "TOON ",
                SurfaceStyle::Classic(_) => "CLASSIC ",
                _ => "",
            };
            let at = at + UVec2::new(letter, self.caption.saturating_sub(7 * letter) / 2);
            let at = captions::write(&mut self.picture, at, letter, DIM, kind);
            captions::write(&mut self.picture, at, letter, INK, &name.to_uppercase());
        }
    }
}
