//! Feeds from image files, from images of the game, and from what another camera draws.

use super::{SIDECAR, SIZE, gray, player, state, statistics, update_until, write_clip};
use crate::gpu;
use bevy::{
    asset::RenderAssetUsages,
    camera::RenderTarget,
    prelude::*,
    render::{
        RenderPlugin,
        render_resource::{Extent3d, TextureDimension, TextureFormat, WgpuLimits},
        settings::{WgpuSettings, WgpuSettingsPriority},
    },
};
use bevy_mirrorball::{
    camera::{CameraPlugin, FeedState, FramePixels},
    headless,
    prelude::*,
};

#[test]
fn a_picture_file_is_decoded_in_the_background() {
    let folder = write_clip("still", SIDECAR, &[("still.png", 77)]);
    let mut app = player();
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::file(folder.join("still.png")))).id();
    assert!(update_until(&mut app, |app| gray(app, camera).is_some()));
    assert_eq!((gray(&app, camera), state(&app, camera)), (Some(77), FeedState::Playing));
    // A wrong name is noticed, the last picture stays, and another feed takes over.
    app.world_mut().entity_mut(camera).insert(CameraFeed::file(folder.join("nothing.png")));
    assert!(update_until(&mut app, |app| matches!(state(app, camera), FeedState::Failed(_))));
    assert_eq!(gray(&app, camera), Some(77));
    app.world_mut().entity_mut(camera).insert(CameraFeed::file(folder.join("still.png")));
    assert!(update_until(&mut app, |app| state(app, camera) == FeedState::Playing));
}

fn solid_image(gray: u8, format: TextureFormat) -> Image {
    let size = Extent3d { width: SIZE.x, height: SIZE.y, depth_or_array_layers: 1 };
    let pixel = vec![gray; format.block_copy_size(None).expect("no depth format") as usize];
    Image::new_fill(size, TextureDimension::D2, &pixel, format, RenderAssetUsages::all())
}

#[test]
fn an_image_of_the_game_is_a_feed_that_follows_its_changes() {
    let mut app = player();
    app.add_plugins((AssetPlugin::default(), ImagePlugin::default()));
    let image = app.world_mut().resource_mut::<Assets<Image>>().add(solid_image(50, TextureFormat::Rgba8UnormSrgb));
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::image(image.clone()))).id();
    assert!(update_until(&mut app, |app| gray(app, camera) == Some(50)));
    let pictures = statistics(&app, camera).frames;
    app.update();
    app.update();
    assert_eq!(statistics(&app, camera).frames, pictures, "an unchanged image is no new picture");
    let change = |app: &mut App, image: &Handle<Image>, to: Image| {
        let mut images = app.world_mut().resource_mut::<Assets<Image>>();
        *images.get_mut(image).expect("exists") = to;
    };
    change(&mut app, &image, solid_image(90, TextureFormat::Rgba8Unorm));
    assert!(update_until(&mut app, |app| gray(app, camera) == Some(90)));
    // A format that cannot be used is said; a usable one ends the trouble.
    change(&mut app, &image, solid_image(1, TextureFormat::Rgba16Float));
    assert!(update_until(&mut app, |app| matches!(state(app, camera), FeedState::Lost(_))));
    assert_eq!(gray(&app, camera), Some(90));
    change(&mut app, &image, solid_image(20, TextureFormat::Bgra8UnormSrgb));
    assert!(update_until(&mut app, |app| gray(app, camera) == Some(20)));
    assert_eq!(state(&app, camera), FeedState::Playing);
}

#[test]
fn the_first_mip_level_of_an_image_is_its_frame() {
    let mut app = player();
    app.add_plugins((AssetPlugin::default(), ImagePlugin::default()));
    let mut image = solid_image(50, TextureFormat::Rgba8UnormSrgb);
    image.texture_descriptor.mip_level_count = 3;
    let smaller = 4 * (4 * 3 + 2);
    image.data.as_mut().expect("on the CPU").extend(vec![9; smaller]);
    let image = app.world_mut().resource_mut::<Assets<Image>>().add(image);
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::image(image))).id();
    assert!(update_until(&mut app, |app| gray(app, camera) == Some(50)), "{:?}", state(&app, camera));
}

/// Longest side of a texture that the device of a test is allowed.
const MAX_EDGE: u32 = 2048;

#[test]
fn a_frame_larger_than_any_texture_is_scaled_down_and_stays_right() {
    let limits = WgpuLimits { max_texture_dimension_2d: MAX_EDGE, ..default() };
    let settings = WgpuSettings { limits, priority: WgpuSettingsPriority::WebGPU, ..default() };
    let render = RenderPlugin { render_creation: settings.into(), synchronous_pipeline_compilation: true, ..default() };
    let Some(mut app) = gpu::app_with(headless::default_plugins().set(render), |app| {
        app.add_plugins(CameraPlugin);
    }) else {
        return;
    };
    let size = UVec2::new(2 * MAX_EDGE, 16);
    let half = |x: u32| if x < MAX_EDGE { [200, 100, 50, 255] } else { [20, 40, 60, 255] };
    let pixels = (0..size.element_product()).flat_map(|i| half(i % size.x)).collect();
    let pixels = std::sync::Arc::new(FramePixels::new(size, pixels).expect("fits"));
    let (picture, target) = headless::add_target(&mut app, UVec2::new(128, 1));
    let intrinsics = Intrinsics::new(Vec2::splat(3000.0), 0.5 * size.as_vec2(), size);
    let camera = (ArCamera { fit: FrameFit::Stretch, ..ArCamera::new(intrinsics) }, target);
    let feed = CameraFeed::pixels(pixels.clone()).with_pace(FeedPace::Lockstep);
    let of_feed = app.world_mut().spawn((camera, feed)).id();
    let of_game = app.world_mut().spawn(CameraFrame::new(pixels, 1, default())).id();
    headless::settle(&mut app).expect("the game goes on");
    assert_eq!(state(&app, of_feed), FeedState::Playing);
    for camera in [of_feed, of_game] {
        let frame = app.world().get::<CameraFrame>(camera).expect("a frame");
        assert_eq!(frame.pixels.size, UVec2::new(MAX_EDGE, 8));
        let [left, right] = [10, MAX_EDGE as i32 - 10].map(|x| frame.pixels.rgb8(x, 4));
        assert_eq!((left, right), ([200, 100, 50], [20, 40, 60]));
        assert_eq!(ArCamera::new(intrinsics).intrinsics_for(frame).focal, Vec2::splat(1500.0));
    }
    let bytes = headless::read_texture(&mut app, &picture).expect("the picture comes back");
    assert_eq!((&bytes[..3], &bytes[508..511]), (&[200, 100, 50][..], &[20, 40, 60][..]));
}

#[test]
fn what_another_camera_draws_is_a_feed() {
    let Some(mut app) = gpu::app(|app| {
        app.add_plugins(CameraPlugin);
    }) else {
        return;
    };
    let (drawn, target) = headless::add_target(&mut app, SIZE);
    let color = Color::srgb_u8(200, 100, 50);
    let clear = Camera { clear_color: ClearColorConfig::Custom(color), ..default() };
    app.world_mut().spawn((Camera3d::default(), bevy::core_pipeline::tonemapping::Tonemapping::None, clear, target));
    let (_, target): (_, RenderTarget) = headless::add_target(&mut app, SIZE);
    let camera = app.world_mut().spawn((ArCamera::default(), target, CameraFeed::image(drawn))).id();
    let picture = |app: &App| app.world().get::<CameraFrame>(camera).map(|frame| frame.pixels.rgb8(4, 4));
    let is_seen = update_until(&mut app, |app| picture(app) == Some([200, 100, 50]));
    assert!(is_seen, "{:?}, {:?}", picture(&app), state(&app, camera));
    assert!(statistics(&app, camera).frames > 1, "every frame is a new picture");
    // The reader goes with the feed.
    let pixels = FramePixels::new(SIZE, vec![9; 4 * 48]).expect("fits");
    app.world_mut().entity_mut(camera).insert(CameraFeed::pixels(pixels));
    assert!(update_until(&mut app, |app| picture(app) == Some([9, 9, 9])));
    let pictures = statistics(&app, camera).frames;
    for _ in 0..5 {
        app.update();
    }
    assert_eq!(statistics(&app, camera).frames, pictures);
}
