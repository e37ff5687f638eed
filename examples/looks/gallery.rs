//! The desk drawn to files: in one look, or in all of them side by side, with their names.

use crate::{
    comparison,
    desk::{self, CLIP, STILL},
    look::{Look, Thing, ThingData, show},
    options::{Options, Subject},
    presets,
    sheet::Sheet,
    support::{Outcome, asset_path, fits_device, has_loaded, headless_log, loading_error, rgb_image},
};
use bevy::{animation::AnimationPlugin, camera::RenderTarget, prelude::*};
use bevy_mirrorball::{camera::Clip, environment_map::EnvironmentCube, headless, prelude::*};
use image::RgbImage;
use std::{path::Path, time::Duration};

/// Longest wait for assets and shaders that load in the background, and for shadow maps.
const MAX_WAIT: Duration = Duration::from_secs(120);
/// Number of frames after which a new style has reached the renderer, and the strongest light has taken over.
const SETTLING_FRAMES: u32 = 10;
const COLUMNS: u32 = 3;
/// Corners of the part of the picture that a strip of the gallery shows, as fractions of its size.
const STRIP: [Vec2; 2] = [Vec2::new(0.0, 0.265), Vec2::new(0.845, 0.93)];

pub(crate) fn run(options: &Options) -> Outcome<()> {
    let mut studio = Studio::new(options)?;
    let picture = match options.subject() {
        Subject::Gallery => all_looks(&mut studio)?,
        Subject::Comparison => comparison::draw(&mut studio)?,
        Subject::Desk => studio.draw()?,
    };
    picture.save(&options.out).map_err(|error| format!("cannot write {}: {error}", options.out.display()))?;
    println!("looks: see {}", options.out.display());
    Ok(())
}

fn all_looks(studio: &mut Studio) -> Outcome<RgbImage> {
    let mut sheet = Sheet::new(studio.size, STRIP, COLUMNS, presets::NAMES.len() as u32);
    for (i, (name, look)) in (0..).zip(presets::all()) {
        studio.show(&look);
        let kind = match look.style {
            SurfaceStyle::Toon(_) if name != "toon" => "TOON ",
            SurfaceStyle::Classic(_) => "CLASSIC ",
            _ => "",
        };
        sheet.add(i, kind, name, &studio.draw()?);
    }
    Ok(sheet.picture)
}

/// The desk in an app without a window, loaded and measured.
pub(crate) struct Studio {
    pub app: App,
    /// Size at which it is drawn, in pixels.
    pub size: UVec2,
    target: Handle<Image>,
}

impl Studio {
    fn new(options: &Options) -> Outcome<Self> {
        let looks = options.looks()?;
        let clip = Clip::open(asset_path(CLIP))?;
        let mut app = headless::build_app(headless::default_plugins(), |app| {
            // The fox has animations.
            app.add_plugins((headless_log(), AnimationPlugin));
            desk::build(app, looks);
        })?;
        fits_device(&app, options.size)?;
        let (target, camera): (_, RenderTarget) = headless::add_target(&mut app, options.size);
        let feed = CameraFeed::file(asset_path(STILL)).with_pace(FeedPace::Lockstep);
        app.world_mut().spawn((ArCamera { intrinsics: clip.intrinsics, ..default() }, feed, camera));
        load(&mut app)?;
        Ok(Self { app, size: options.size, target })
    }

    /// Shows all things in one look.
    pub(crate) fn show(&mut self, look: &Look) {
        let world = self.app.world_mut();
        let mut things = world.query_filtered::<ThingData, With<Thing>>();
        show(&mut things.query_mut(world), &look.for_all());
    }

    /// Draws frames until changes show and all shadow maps are up to date, and returns the last one.
    pub(crate) fn draw(&mut self) -> Outcome<RgbImage> {
        let app = &mut self.app;
        for _ in 0..SETTLING_FRAMES {
            headless::update(app)?;
        }
        headless::settle(app)?;
        headless::update_until(app, "drawing all shadow maps", MAX_WAIT, |app| {
            let world = app.world_mut();
            !world.query::<&DomeState>().iter(world).any(|dome| dome.outdated > 0)
        })?;
        Ok(rgb_image(self.size, &headless::read_texture(app, &self.target)?)?)
    }
}

/// Waits for the scenes and for the light that is measured in the ball.
fn load(app: &mut App) -> Outcome<()> {
    headless::update_until(app, "loading the scenes", MAX_WAIT, |app| has_loaded(app.world_mut()))?;
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
