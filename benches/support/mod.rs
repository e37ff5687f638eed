//! What the benchmarks share: the time of a frame, medians, and a static environment.

#![allow(dead_code, reason = "each benchmark uses a part, and which one differs")]

use bevy::{
    asset::Handle,
    prelude::*,
    render::{
        RenderApp,
        render_resource::{PollType, TextureUsages},
        renderer::{RenderAdapterInfo, RenderDevice},
    },
};
use bevy_mirrorball::{environment_map::CubePixels, headless};
use std::{path::PathBuf, time::Instant};

pub(crate) type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

pub(crate) fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Renders one frame and returns the time until the GPU has finished it, in milliseconds.
pub(crate) fn frame_time(app: &mut App) -> Outcome<f64> {
    let started = Instant::now();
    headless::update(app)?;
    // A lost device does not respond; the next frame reports it.
    let _ = app.sub_app(RenderApp).world().resource::<RenderDevice>().poll(PollType::wait_indefinitely());
    Ok(started.elapsed().as_secs_f64() * 1e3)
}

/// Calls a function for all items, in alternating order, so that none always runs on the warmer machine.
pub(crate) fn alternate<T>(
    items: &mut [T],
    blocks: usize,
    mut measure: impl FnMut(&mut T) -> Outcome<()>,
) -> Outcome<()> {
    for block in 0..blocks {
        for i in 0..items.len() {
            let turn = if block % 2 == 0 { i } else { items.len() - 1 - i };
            measure(&mut items[turn])?;
        }
    }
    Ok(())
}

/// Name of the device and its driver, without commas.
pub(crate) fn device_name(app: &App) -> String {
    let info = app.sub_app(RenderApp).world().resource::<RenderAdapterInfo>();
    format!("{} {}", info.name, info.driver_info).replace(',', ";")
}

/// A gray sky that is brighter overhead, as a file would give it: nothing on the GPU writes it.
pub(crate) fn gray_sky(images: &mut Assets<Image>) -> Handle<Image> {
    let sky = |i: u32| Vec3::splat(if i / 256 == 2 { 1.0 } else { 0.4 });
    let mut map = CubePixels { edge: 16, texels: (0..6 * 256).map(sky).collect() }.to_image();
    map.texture_descriptor.usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
    images.add(map)
}

/// Writes a table to a file, or prints it.
pub(crate) fn save(table: &str, file: Option<PathBuf>) -> Outcome<()> {
    let Some(file) = file else {
        print!("{table}");
        return Ok(());
    };
    Ok(std::fs::write(&file, table).map_err(|error| format!("cannot write {}: {error}", file.display()))?)
}
