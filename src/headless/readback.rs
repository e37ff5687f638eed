//! Readback of textures from the GPU to the CPU.

use super::{HeadlessError, update};
use crate::device::{self, DeviceState, MAX_BUSY_TIME};
use bevy::{
    ecs::observer::On,
    prelude::*,
    render::{
        gpu_readback::{Readback, ReadbackComplete},
        renderer::RenderDevice,
    },
};
use std::{
    collections::VecDeque,
    time::{Duration, Instant},
};

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
        match device::wait(&device, Duration::from_millis(500).min(patience)) {
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

/// Alignment in bytes of the rows of textures that wgpu copies to the CPU.
const ROW_ALIGNMENT: usize = 256;

/// Bytes of a texture copied from the GPU, without the padding behind each of its rows, which are `row` bytes long.
pub(crate) fn unpad_rows(bytes: &[u8], row: usize) -> Vec<u8> {
    let padded_row = row.next_multiple_of(ROW_ALIGNMENT);
    bytes.chunks(padded_row).flat_map(|padded| &padded[..row.min(padded.len())]).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn padding_behind_rows_is_dropped() {
        let mut bytes = vec![9; 2 * ROW_ALIGNMENT];
        bytes[..4].copy_from_slice(&[1, 2, 3, 4]);
        bytes[ROW_ALIGNMENT..ROW_ALIGNMENT + 4].copy_from_slice(&[5, 6, 7, 8]);
        assert_eq!(unpad_rows(&bytes, 4), [1, 2, 3, 4, 5, 6, 7, 8]);
    }
}
