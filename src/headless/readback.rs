//! Readback of textures from the GPU to the CPU.

use super::{
    HeadlessError,
    device_wait::{DeviceState, MAX_BUSY_TIME, wait},
    update,
};
use crate::unpad_rows::unpad_rows;
use bevy::{
    ecs::observer::On,
    platform::time::Instant,
    prelude::*,
    render::{
        gpu_readback::{Readback, ReadbackComplete},
        renderer::RenderDevice,
    },
};
use std::{collections::VecDeque, time::Duration};

/// Largest number of frames in which a texture arrives once the GPU is idle, with a margin.
const MAX_IDLE_FRAMES: u32 = 16;

/// Renders one frame and returns the bytes of the first mip level of a texture after it: rows without padding, from
/// top to bottom, layer after layer. Cameras are paused until the bytes arrive.
///
/// # Errors
/// [`HeadlessError::NoAnswer`] if the texture does not exist or cannot be copied from; [`HeadlessError::Hung`] if the
/// GPU takes two minutes over a frame; as [`update`].
pub fn read_texture(app: &mut App, image: &Handle<Image>) -> Result<Vec<u8>, HeadlessError> {
    let mut texture = Vec::new();
    record(app, image, 1, |_, _| (), |_, bytes| texture = bytes)?;
    Ok(texture)
}

/// Textures that have arrived from the GPU, in order.
#[derive(Resource, Default)]
struct ReadbackAnswers(VecDeque<Vec<u8>>);

/// Renders a number of frames and passes the texture of each to `on_readback`, as bytes like those of
/// [`read_texture`].
///
/// `after_update` is called with the number of each frame as soon as it is drawn, `on_readback` with the same number
/// when the bytes have arrived, a frame or two later.
///
/// # Errors
/// [`HeadlessError::NoAnswer`] if the texture does not exist or cannot be copied from; [`HeadlessError::Hung`] if the
/// GPU takes two minutes over a frame; as [`update`].
pub fn record(
    app: &mut App,
    image: &Handle<Image>,
    frames: u32,
    mut after_update: impl FnMut(&mut App, u32),
    mut on_readback: impl FnMut(u32, Vec<u8>),
) -> Result<(), HeadlessError> {
    app.insert_resource(ReadbackAnswers::default());
    let request = app
        .world_mut()
        .spawn(Readback::texture(image.clone()))
        .observe(|answer: On<ReadbackComplete>, mut all: ResMut<ReadbackAnswers>| all.0.push_back(answer.data.clone()))
        .id();
    let mut arrived = 0;
    let mut take_arrived = |app: &mut App| {
        while let Some(bytes) = app.world_mut().resource_mut::<ReadbackAnswers>().0.pop_front() {
            let row = row_bytes(app, image).unwrap_or(bytes.len());
            on_readback(arrived, unpad_rows(&bytes, row));
            arrived += 1;
        }
        arrived
    };
    let mut outcome = Ok(());
    for frame in 0..frames {
        outcome = update(app);
        if outcome.is_err() {
            break;
        }
        after_update(app, frame);
        take_arrived(app);
    }
    app.world_mut().entity_mut(request).remove::<Readback>();
    let paused = pause_cameras(app.world_mut());
    if outcome.is_ok() {
        outcome = wait_for_readbacks(app, MAX_BUSY_TIME, |app| take_arrived(app) as usize, frames as usize);
    }
    for camera in paused {
        if let Some(mut camera) = app.world_mut().get_mut::<Camera>(camera) {
            camera.is_active = true;
        }
    }
    app.world_mut().despawn(request);
    outcome
}

/// Updates until a number of textures has arrived, as long as the device is busy and finishes one now and then.
fn wait_for_readbacks(
    app: &mut App,
    patience: Duration,
    mut arrived: impl FnMut(&mut App) -> usize,
    wanted: usize,
) -> Result<(), HeadlessError> {
    let (mut known, mut last_news, mut idle) = (0, Instant::now(), 0);
    loop {
        let now = arrived(app);
        if now >= wanted {
            return Ok(());
        }
        if now > known {
            (known, last_news, idle) = (now, Instant::now(), 0);
        }
        let Some(device) = app.world().get_resource::<RenderDevice>().cloned() else {
            return Err(HeadlessError::NoAnswer);
        };
        match wait(&device, Duration::from_millis(500).min(patience)) {
            DeviceState::Idle if idle >= MAX_IDLE_FRAMES => return Err(HeadlessError::NoAnswer),
            DeviceState::Idle => idle += 1,
            DeviceState::Busy if last_news.elapsed() > patience => return Err(HeadlessError::Hung(patience)),
            DeviceState::Busy => (),
            DeviceState::Lost => return Err(HeadlessError::Stopped),
        }
        update(app)?;
    }
}

/// Number of bytes in a row of a texture.
fn row_bytes(app: &App, image: &Handle<Image>) -> Option<usize> {
    let texture = &app.world().resource::<Assets<Image>>().get(image)?.texture_descriptor;
    let pixel = texture.format.block_copy_size(None).unwrap_or(4);
    Some((texture.size.width * pixel) as usize)
}

fn pause_cameras(world: &mut World) -> Vec<Entity> {
    let mut paused = Vec::new();
    for (entity, mut camera) in world.query::<(Entity, &mut Camera)>().iter_mut(world) {
        if camera.is_active {
            camera.is_active = false;
            paused.push(entity);
        }
    }
    paused
}
