//! The simplest scenes: one ball, one box, or nothing virtual at all, at 8 to 400 pixels, under every count of samples
//! and every way of computing visibility. What a crowded desk hides shows here.

use crate::gpu;
use bevy::{
    prelude::*,
    render::{
        render_resource::TextureFormat,
        renderer::{RenderAdapter, RenderAdapterInfo},
    },
};
use bevy_mirrorball::{camera::FramePixels, headless, prelude::*, shadows::VisibilitySamples};

/// Largest step between neighboring pixels of a white ball under an even sky, inside of its outline.
const MAX_JUMP: u8 = 20;
/// Largest difference from what is computed in each fragment.
const MAX_DIFFERENCE: u8 = 3;
const GRAY: u8 = 150;
const BALL_RADIUS: f32 = 0.05;
/// Across the picture, in pixels.
const SIZE: UVec2 = UVec2::splat(96);
/// Where the camera stands.
const EYE: Vec3 = Vec3::new(0.0, 0.45, 0.6);

/// What stands on the desk.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Thing {
    Ball,
    Box,
    Nothing,
}

struct Scene {
    app: App,
    picture: Handle<Image>,
    camera: Entity,
    dome: Entity,
}

/// Intrinsics of a camera that sees the thing this many pixels wide. The widest fills the picture; what lies outside is
/// as smooth as what lies inside.
fn intrinsics(pixels: f32) -> Intrinsics {
    let distance = EYE.distance(Vec3::Y * BALL_RADIUS);
    let focal = Vec2::splat(pixels * distance / (2.0 * BALL_RADIUS));
    Intrinsics::new(focal, 0.5 * SIZE.as_vec2(), SIZE)
}

impl Scene {
    /// A camera that sees a thing on a phantom desk, from the front and above.
    fn new(thing: Thing) -> Option<Self> {
        let mut app = gpu::app(|app| {
            app.add_plugins(MirrorballPlugins);
        })?;
        let (picture, target) = headless::add_target(&mut app, SIZE);
        let gray = FramePixels::new(SIZE, vec![GRAY; 4 * SIZE.element_product() as usize]);
        let feed = CameraFeed::pixels(gray.expect("as many bytes as the size says")).with_pace(FeedPace::Lockstep);
        let pose = Transform::from_translation(EYE).looking_at(Vec3::Y * BALL_RADIUS, Vec3::Y);
        let camera = app.world_mut().spawn((ArCamera::new(intrinsics(60.0)), pose, feed, target)).id();
        // Behind the camera, which fits a sky to its picture instead of measuring the ball: alike at every width.
        app.world_mut().spawn((LightProbeSphere::default(), Transform::from_xyz(0.0, 0.05, 2.0)));
        let dome = app.world_mut().spawn(ShadowDomeLight::default()).id();
        let mut meshes = app.world_mut().resource_mut::<Assets<Mesh>>();
        let desk = meshes.add(Plane3d::default().mesh().size(2.0, 2.0));
        let mesh = match thing {
            Thing::Ball => Some(meshes.add(Sphere::new(BALL_RADIUS).mesh().uv(96, 48))),
            Thing::Box => Some(meshes.add(Cuboid::from_length(2.0 * BALL_RADIUS))),
            Thing::Nothing => None,
        };
        app.world_mut().spawn((PhantomObject { casts: false, ..default() }, Mesh3d(desk)));
        if let Some(mesh) = mesh {
            let material = app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial {
                base_color: Color::WHITE,
                perceptual_roughness: 1.0,
                reflectance: 0.0,
                ..default()
            });
            app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::from_xyz(0.0, BALL_RADIUS, 0.0)));
        }
        Some(Self { app, picture, camera, dome })
    }

    /// A picture of the thing at a width in pixels.
    fn shoot(&mut self, pixels: f32, msaa: Msaa, samples: VisibilitySamples) -> Picture {
        self.app.world_mut().entity_mut(self.camera).insert((ArCamera::new(intrinsics(pixels)), msaa));
        self.app.world_mut().entity_mut(self.dome).insert(ShadowDomeLight { samples, ..default() });
        for _ in 0..8 {
            headless::update(&mut self.app).expect("rendering goes on");
        }
        headless::settle(&mut self.app).expect("all shaders compile");
        let bytes = headless::read_texture(&mut self.app, &self.picture).expect("the picture comes back");
        Picture { green: bytes.chunks_exact(4).map(|pixel| pixel[1]).collect() }
    }

    /// Whether the driver's depths of triangles smaller than a pixel are off: those of `SwiftShader` are where a pixel
    /// has several samples.
    fn is_coarse(&self, msaa: Msaa) -> bool {
        msaa != Msaa::Off && self.app.world().resource::<RenderAdapterInfo>().name.contains("SwiftShader")
    }

    /// Whether the driver can be asked about this count of samples.
    fn supports(&self, msaa: Msaa) -> bool {
        let adapter = self.app.world().resource::<RenderAdapter>();
        let formats = [TextureFormat::Rgba8UnormSrgb, TextureFormat::Depth32Float, TextureFormat::Rgb10a2Unorm];
        formats
            .into_iter()
            .all(|format| adapter.get_texture_format_features(format).flags.sample_count_supported(msaa.samples()))
    }
}

struct Picture {
    green: Vec<u8>,
}

impl Picture {
    fn at(&self, x: u32, y: u32) -> u8 {
        self.green[(y * SIZE.x + x) as usize]
    }

    /// Largest step to the right or down between pixels that lie within a number of pixels from the middle.
    fn jump(&self, within: f32) -> u8 {
        let middle = 0.5 * SIZE.as_vec2();
        let is_inside = |x: u32, y: u32| (Vec2::new(x as f32, y as f32) + 0.5).distance(middle) <= within;
        let places = (0..SIZE.y - 1).flat_map(|y| (0..SIZE.x - 1).map(move |x| (x, y)));
        let step = |(x, y): (u32, u32)| {
            let right = if is_inside(x + 1, y) { self.at(x, y).abs_diff(self.at(x + 1, y)) } else { 0 };
            let down = if is_inside(x, y + 1) { self.at(x, y).abs_diff(self.at(x, y + 1)) } else { 0 };
            right.max(down)
        };
        places.filter(|(x, y)| is_inside(*x, *y)).map(step).max().unwrap_or(0)
    }

    /// Largest difference among pixels that lie within a number of pixels from the middle.
    fn difference(&self, other: &Self, within: f32) -> u8 {
        let middle = 0.5 * SIZE.as_vec2();
        let places = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| (x, y)));
        let inside = places.filter(|(x, y)| (Vec2::new(*x as f32, *y as f32) + 0.5).distance(middle) <= within);
        inside.map(|(x, y)| self.at(x, y).abs_diff(other.at(x, y))).max().unwrap_or(0)
    }
}

const COUNTS: [Msaa; 4] = [Msaa::Off, Msaa::Sample2, Msaa::Sample4, Msaa::Sample8];
const SAMPLED: [VisibilitySamples; 3] =
    [VisibilitySamples::Interleaved, VisibilitySamples::Half, VisibilitySamples::Full];

#[test]
fn a_lone_ball_is_smooth_under_every_count_of_samples() {
    let Some(mut scene) = Scene::new(Thing::Ball) else { return };
    for pixels in [8.0, 20.0, 60.0, 400.0] {
        // A pixel inside the outline: at the rim the desk shows through.
        let within = 0.5 * pixels - 1.0;
        for msaa in COUNTS {
            if !scene.supports(msaa) {
                println!("{msaa:?} is not supported here");
                continue;
            }
            let exact = scene.shoot(pixels, msaa, VisibilitySamples::Fragment);
            assert!(exact.jump(within) <= MAX_JUMP, "{pixels} pixels, {msaa:?}, each fragment: {}", exact.jump(within));
            for samples in SAMPLED {
                if pixels < 10.0 && samples == VisibilitySamples::Full && scene.is_coarse(msaa) {
                    println!(
                        "skipped: SwiftShader, {msaa:?}, {pixels} pixels: depths of triangles smaller than a pixel"
                    );
                    continue;
                }
                let shown = scene.shoot(pixels, msaa, samples);
                let (jump, difference) = (shown.jump(within), shown.difference(&exact, within));
                println!("{pixels} pixels, {msaa:?}, {samples:?}: jumps {jump}, off by {difference}");
                assert!(jump <= MAX_JUMP && difference <= MAX_DIFFERENCE, "{pixels} pixels, {msaa:?}, {samples:?}");
            }
        }
    }
}

#[test]
fn a_lone_box_looks_the_same_under_every_count_of_samples() {
    let Some(mut scene) = Scene::new(Thing::Box) else { return };
    for pixels in [16.0, 60.0, 300.0] {
        for msaa in [Msaa::Off, Msaa::Sample4].into_iter().filter(|msaa| scene.supports(*msaa)).collect::<Vec<_>>() {
            let exact = scene.shoot(pixels, msaa, VisibilitySamples::Fragment);
            for samples in SAMPLED {
                let shown = scene.shoot(pixels, msaa, samples);
                // Within its middle, which lies on faces and an edge of the box.
                let difference = shown.difference(&exact, 0.3 * pixels);
                println!("{pixels} pixels, {msaa:?}, {samples:?}: off by {difference}");
                assert!(difference <= MAX_DIFFERENCE, "{pixels} pixels, {msaa:?}, {samples:?}");
            }
        }
    }
}

#[test]
fn nothing_but_a_phantom_leaves_the_picture_alone() {
    let Some(mut scene) = Scene::new(Thing::Nothing) else { return };
    for msaa in COUNTS.into_iter().filter(|msaa| *msaa == Msaa::Off || *msaa == Msaa::Sample4) {
        for samples in SAMPLED.into_iter().chain([VisibilitySamples::Fragment]) {
            let shown = scene.shoot(60.0, msaa, samples);
            let worst = shown.green.iter().map(|green| green.abs_diff(GRAY)).max();
            assert!(worst <= Some(1), "{msaa:?}, {samples:?}: {worst:?}");
        }
    }
}
