//! The frame behind the scene equals what the camera delivered, where nothing virtual covers it.

use crate::gpu;
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels},
    offscreen,
    prelude::*,
};

/// A picture in which every pixel differs from its neighbors and every channel value occurs.
fn busy_picture(size: UVec2) -> FramePixels {
    let rgba = (0..size.x * size.y).flat_map(|i| {
        let (x, y) = (i % size.x, i / size.x);
        [(i * 7 % 256) as u8, (x * 3 + y * 5) as u8, (x ^ y) as u8, 255]
    });
    FramePixels::new(size, rgba.collect()).expect("as many bytes as the size says")
}

fn show(picture: FramePixels, view: UVec2, fit: FrameFit) -> Option<Vec<u8>> {
    let mut app = gpu::app(|app| {
        app.add_plugins(CameraPlugin);
    })?;
    let (image, target) = offscreen::add_target(&mut app, view);
    let clear = Camera { clear_color: Color::srgb_u8(10, 20, 30).into(), ..default() };
    app.world_mut().spawn((
        ArCamera { fit, ..default() },
        clear,
        target,
        CameraFeed::pixels(picture).with_pace(FeedPace::Lockstep),
    ));
    // The first update uploads the picture, the second is sure to show it.
    app.update();
    app.update();
    Some(offscreen::read_texture(&mut app, &image).expect("the picture comes back"))
}

#[test]
fn at_one_to_one_the_output_equals_the_input() {
    let size = UVec2::new(96, 64);
    let Some(shown) = show(busy_picture(size), size, FrameFit::Cover) else { return };
    let worst = busy_picture(size).rgba.iter().zip(&shown).map(|(a, b)| a.abs_diff(*b)).max();
    println!("largest difference {worst:?}/255");
    assert!(worst <= Some(1), "differs by {worst:?}");
}

#[test]
fn a_contained_picture_has_bars_in_the_clear_color_and_a_covering_one_has_none() {
    let (picture, view) = (UVec2::new(32, 32), UVec2::new(96, 32));
    let Some(contained) = show(busy_picture(picture), view, FrameFit::Contain) else { return };
    let pixel = |shown: &[u8], x: usize, y: usize| shown[4 * (96 * y + x)..][..3].to_vec();
    assert_eq!(pixel(&contained, 31, 16), [10, 20, 30]);
    assert_eq!(pixel(&contained, 64, 16), [10, 20, 30]);
    assert_eq!(pixel(&contained, 32, 0), busy_picture(picture).rgba[..3]);
    let covering = show(busy_picture(picture), view, FrameFit::Cover).expect("a GPU was there a moment ago");
    assert!((0..96).all(|x| pixel(&covering, x, 16) != [10, 20, 30]));
}
