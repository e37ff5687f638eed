//! Frame source that shows an image of the game.

use super::{
    CameraError, CameraFeed, FramePixels,
    feed::FeedSource,
    source::{Arrival, FrameSource, SourceFrame},
};
use crate::unpad_rows::unpad_rows;
use bevy::{
    ecs::observer::On,
    platform::time::Instant,
    prelude::*,
    render::{
        gpu_readback::{Readback, ReadbackComplete},
        render_resource::{TextureDescriptor, TextureDimension, TextureFormat, TextureUsages},
    },
};
use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

/// Newest pixels of an image, until the feed is polled.
type Slot = Arc<Mutex<Option<Delivery>>>;

struct Delivery {
    pixels: Result<FramePixels, CameraError>,
    time: Duration,
    dropped: u64,
}

fn deliver(slot: &Slot, convert: impl FnOnce() -> Result<FramePixels, CameraError>) {
    let started = Instant::now();
    let pixels = convert();
    let mut slot = slot.lock().unwrap_or_else(PoisonError::into_inner);
    let dropped = slot.take().map_or(0, |unseen| unseen.dropped + 1);
    *slot = Some(Delivery { pixels, time: started.elapsed(), dropped });
}

/// Frame source of a feed that shows an image.
pub(super) struct ImageSource(Slot);

impl ImageSource {
    /// Creates a source and the slot that receives its pixels.
    pub(super) fn new() -> (Self, ImageSlot) {
        let slot = Slot::default();
        (Self(slot.clone()), ImageSlot { slot, is_filled: false })
    }
}

impl FrameSource for ImageSource {
    fn poll(&mut self, now: Duration) -> Arrival {
        let Some(delivery) = self.0.lock().unwrap_or_else(PoisonError::into_inner).take() else {
            return Arrival::default();
        };
        match delivery.pixels {
            Ok(pixels) => {
                let frame = SourceFrame {
                    pixels: Arc::new(pixels),
                    captured: now,
                    decode_time: delivery.time,
                    intrinsics: None,
                    exposure: 1.0,
                };
                Arrival { frame: Some(frame), dropped: delivery.dropped, ..default() }
            }
            // The game may change the image.
            Err(error) => Arrival::lost(&error),
        }
    }
}

/// The receiving end of an [`ImageSource`].
#[derive(Component)]
pub(super) struct ImageSlot {
    slot: Slot,
    /// Whether the image has been read once. From then on, only changes of the image are read.
    is_filled: bool,
}

/// Marks the child entity that reads the image of a feed back from the GPU.
#[derive(Component)]
pub(super) struct ImageReader;

type WatchedFeed = (Entity, &'static CameraFeed, &'static mut ImageSlot, Option<&'static Children>);

pub(super) fn watch_images(
    mut commands: Commands,
    mut events: MessageReader<AssetEvent<Image>>,
    images: Res<Assets<Image>>,
    mut feeds: Query<WatchedFeed>,
    readers: Query<(), With<ImageReader>>,
) {
    let changed: Vec<AssetId<Image>> = events
        .read()
        .filter_map(|event| match event {
            AssetEvent::Modified { id } => Some(*id),
            _ => None,
        })
        .collect();
    for (camera, feed, mut watched, children) in &mut feeds {
        let FeedSource::Image(handle) = &feed.source else {
            continue;
        };
        if watched.is_filled && !changed.contains(&handle.id()) {
            continue;
        }
        let Some(image) = images.get(handle) else {
            continue; // still loading
        };
        watched.is_filled = true;
        let slot = watched.slot.clone();
        let (size, format) = (image.size(), image.texture_descriptor.format);
        if let Err(problem) = check(image) {
            deliver(&slot, || Err(CameraError::Image(problem)));
            continue;
        }
        let reader = children.into_iter().flatten().find(|child| readers.contains(**child)).copied();
        if let Some(bytes) = image.data.as_ref().filter(|bytes| !bytes.is_empty()) {
            deliver(&slot, || from_texture(size, format, bytes));
            if let Some(reader) = reader {
                commands.entity(reader).despawn();
            }
        } else if !image.texture_descriptor.usage.contains(TextureUsages::COPY_SRC) {
            let problem = "it is not on the CPU and lacks the texture usage COPY_SRC".to_owned();
            deliver(&slot, || Err(CameraError::Image(problem)));
        } else if reader.is_none() {
            let read = move |answer: On<ReadbackComplete>| {
                deliver(&slot, || from_texture(size, format, &unpad_rows(&answer.data, 4 * size.x as usize)));
            };
            commands.spawn((ImageReader, Readback::texture(handle.clone()), ChildOf(camera))).observe(read);
        }
    }
}

/// Returns an error with the remedy if frames cannot be made of an image.
fn check(image: &Image) -> Result<(), String> {
    let TextureDescriptor { size, dimension, format, .. } = image.texture_descriptor;
    if dimension != TextureDimension::D2 {
        return Err(format!("it is a {dimension:?} texture; give a 2D image (TextureDimension::D2)"));
    }
    if size.depth_or_array_layers != 1 {
        return Err(format!(
            "it has {} layers, as arrays and cubes do; give a 2D image with a single layer, for example a copy of one of them",
            size.depth_or_array_layers
        ));
    }
    swaps_red_and_blue(format).map(|_| ())
}

/// Returns whether blue comes first in a format; an error with the remedy for formats that cannot be read.
fn swaps_red_and_blue(format: TextureFormat) -> Result<bool, String> {
    match format {
        TextureFormat::Rgba8Unorm | TextureFormat::Rgba8UnormSrgb => Ok(false),
        TextureFormat::Bgra8Unorm | TextureFormat::Bgra8UnormSrgb => Ok(true),
        other => {
            let remedy = if other.is_compressed() {
                "load it uncompressed, for example from PNG or JPEG"
            } else {
                "convert it with Image::convert(TextureFormat::Rgba8UnormSrgb), or render into an image of that format"
            };
            Err(format!("its format is {other:?} and neither 8-bit Rgba8 nor Bgra8; {remedy}"))
        }
    }
}

/// Converts the bytes of a texture to pixels. Its first mip level is the first that the bytes hold; others are ignored.
fn from_texture(size: UVec2, format: TextureFormat, bytes: &[u8]) -> Result<FramePixels, CameraError> {
    let swaps_red_and_blue = swaps_red_and_blue(format).map_err(CameraError::Image)?;
    let expected = 4 * size.x as usize * size.y as usize;
    let found = bytes.len();
    let wrong_size =
        || CameraError::Image(format!("{} × {} pixels have {expected} bytes and not {found}", size.x, size.y));
    let mut rgba = bytes.get(..expected).ok_or_else(wrong_size)?.to_vec();
    if swaps_red_and_blue {
        for pixel in rgba.chunks_exact_mut(4) {
            pixel.swap(0, 2);
        }
    }
    FramePixels::new(size, rgba).ok_or_else(wrong_size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blue_changes_places_with_red() {
        let bytes = [1, 2, 3, 4, 5, 6, 7, 8];
        let pixels = from_texture(UVec2::new(1, 2), TextureFormat::Bgra8Unorm, &bytes).expect("fits");
        assert_eq!(pixels.rgba, [3, 2, 1, 4, 7, 6, 5, 8]);
    }

    #[test]
    fn the_first_mip_level_is_meant() {
        // 2 × 2 pixels, and a second level of one.
        let bytes: Vec<u8> = (0..20).collect();
        let pixels = from_texture(UVec2::splat(2), TextureFormat::Rgba8UnormSrgb, &bytes).expect("fits");
        assert_eq!(pixels.rgba, bytes[..16]);
    }

    #[test]
    fn what_is_no_frame_is_refused_with_what_would_be() {
        let image = |layers, format: TextureFormat| {
            let mut image = Image::default();
            image.texture_descriptor.format = format;
            image.texture_descriptor.size.depth_or_array_layers = layers;
            image
        };
        let said = |layers, format| check(&image(layers, format)).expect_err("refused");
        let cube = said(6, TextureFormat::Rgba8Unorm);
        assert!(cube.contains("6 layers") && cube.contains("single layer"), "{cube}");
        let float = said(1, TextureFormat::Rgba16Float);
        assert!(float.contains("Rgba16Float") && float.contains("Rgba8UnormSrgb"), "{float}");
        let compressed = said(1, TextureFormat::Bc7RgbaUnormSrgb);
        assert!(compressed.contains("uncompressed"), "{compressed}");
        assert_eq!(check(&image(1, TextureFormat::Bgra8UnormSrgb)), Ok(()));
    }

    #[test]
    fn other_formats_and_wrong_lengths_are_refused() {
        assert!(from_texture(UVec2::ONE, TextureFormat::Rgba16Float, &[0; 8]).is_err());
        assert!(from_texture(UVec2::ONE, TextureFormat::Rgba8Unorm, &[0; 3]).is_err());
    }
}
