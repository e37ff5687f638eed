//! Pictures without a window.

use crate::{
    Lab, build, camera,
    support::{Outcome, fits_device},
};
use bevy::prelude::*;
use bevy_mirrorball::headless;

/// Seconds per frame, and frames per picture: shadow maps need several frames to catch up.
const STEP: f32 = 1.0 / 30.0;
const FRAMES_A_PICTURE: u32 = 6;
/// Number of frames after which roles, materials, light and the first shadow maps exist.
const WARM_UP_FRAMES: u32 = 6;

pub(crate) struct Picture {
    pub app: App,
    image: Handle<Image>,
}

impl Picture {
    pub(crate) fn new(lab: Lab, size: UVec2) -> Outcome<Self> {
        let mut app = headless::build_app(headless::default_plugins(), |app| build(app, lab))?;
        fits_device(&app, size)?;
        let (image, target) = headless::add_target(&mut app, size);
        app.world_mut().spawn((camera(), target));
        for _ in 0..WARM_UP_FRAMES {
            headless::update(&mut app)?;
        }
        headless::settle(&mut app)?;
        Ok(Self { app, image })
    }

    /// Lets the cars drive for a step, and returns the picture.
    pub(crate) fn draw_step(&mut self) -> Outcome<Vec<u8>> {
        self.app.world_mut().resource_mut::<Lab>().time += STEP;
        self.draw()
    }

    /// Lets the cars drive for a while, and returns the picture.
    pub(crate) fn draw_next(&mut self) -> Outcome<Vec<u8>> {
        for _ in 1..FRAMES_A_PICTURE {
            self.app.world_mut().resource_mut::<Lab>().time += STEP;
            headless::update(&mut self.app)?;
        }
        self.draw_step()
    }

    /// Returns the picture: 8 bits per channel, RGBA.
    pub(crate) fn draw(&mut self) -> Outcome<Vec<u8>> {
        Ok(headless::read_texture(&mut self.app, &self.image)?)
    }
}
