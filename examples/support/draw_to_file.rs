//! A program without a window that draws some frames and writes the last one.

use super::{Outcome, fits_device, has_loaded, rgb_image};
use bevy::{
    app::PluginsState,
    camera::RenderTarget,
    input::{
        ButtonState,
        keyboard::{Key, KeyboardInput},
    },
    prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_mirrorball::{headless, prelude::*};
use std::{path::PathBuf, time::Duration};

/// Time that passes from frame to frame, as between frames of the recorded desk.
const STEP: Duration = Duration::from_nanos(1_000_000_000 / 15);
/// Longest wait for scenes that load in the background.
const MAX_WAIT: Duration = Duration::from_secs(120);

/// Replaces the runner of the app. All cameras draw to one texture, and feeds wait for the updates, so that each run
/// gives the same picture.
#[derive(Clone)]
pub(crate) struct DrawToFile {
    pub name: String,
    pub frames: u32,
    pub size: UVec2,
    pub out: PathBuf,
    pub key: Option<KeyCode>,
}

impl Plugin for DrawToFile {
    fn build(&self, app: &mut App) {
        let (picture, target) = headless::add_target(app, self.size);
        let this = self.clone();
        app.insert_resource(TimeUpdateStrategy::ManualDuration(STEP))
            .add_observer(move |added: On<Add, Camera>, targets: Query<&RenderTarget>, mut commands: Commands| {
                if let Ok(RenderTarget::Window(_)) = targets.get(added.entity) {
                    commands.entity(added.entity).insert(target.clone());
                }
            })
            .add_observer(|inserted: On<Insert, CameraFeed>, feeds: Query<&CameraFeed>, mut commands: Commands| {
                if let Some(feed) = feeds.get(inserted.entity).ok().filter(|feed| feed.pace() == FeedPace::Live) {
                    commands.entity(inserted.entity).insert(feed.clone().with_pace(FeedPace::Lockstep));
                }
            })
            .set_runner(move |app| match this.draw(app, &picture) {
                Ok(()) => AppExit::Success,
                Err(error) => {
                    eprintln!("{}: {error}", this.name);
                    AppExit::error()
                }
            });
    }
}

impl DrawToFile {
    fn draw(&self, mut app: App, picture: &Handle<Image>) -> Outcome<()> {
        while app.plugins_state() == PluginsState::Adding {
            bevy::tasks::tick_global_task_pools_on_main_thread();
        }
        app.finish();
        app.cleanup();
        fits_device(&app, self.size)?;
        headless::update_until(&mut app, "loading the scenes", MAX_WAIT, |app| has_loaded(app.world_mut()))?;
        headless::settle(&mut app)?;
        restart_feeds(app.world_mut());
        app.world_mut().write_message_batch(self.key.map(press));
        for _ in 1..self.frames {
            headless::update(&mut app)?;
        }
        let bytes = headless::read_texture(&mut app, picture)?;
        let out = self.out.display();
        rgb_image(self.size, &bytes)?.save(&self.out).map_err(|error| format!("cannot write {out}: {error}"))?;
        println!("{}: see {out}", self.name);
        Ok(())
    }
}

/// Starts all feeds again, from their first frames.
fn restart_feeds(world: &mut World) {
    let feeds: Vec<(Entity, CameraFeed)> =
        world.query::<(Entity, &CameraFeed)>().iter(world).map(|(camera, feed)| (camera, feed.clone())).collect();
    for (camera, feed) in feeds {
        world.entity_mut(camera).insert(feed);
    }
}

fn press(key_code: KeyCode) -> KeyboardInput {
    let logical_key = Key::Unidentified(bevy::input::keyboard::NativeKey::Unidentified);
    let (state, window) = (ButtonState::Pressed, Entity::PLACEHOLDER);
    KeyboardInput { key_code, logical_key, state, text: None, repeat: false, window }
}
