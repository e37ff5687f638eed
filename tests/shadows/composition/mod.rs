//! Effects that games add to an `ArCamera`: a photograph behind, a phantom desk on its middle, a virtual box on the
//! desk. Under each effect the photograph stays where nothing virtual is, and the box and its shadow are there. One
//! test for each row of the table in the documentation of `materials`.

mod film;
mod order;
mod parts;
mod time;
mod view;

use crate::{
    desk::{Desk, HEIGHT, INTRINSICS, SIZE},
    drawing,
};
use bevy::{camera::RenderTarget, prelude::*};
use bevy_anti_alias::{fxaa::FxaaPlugin, taa::TemporalAntiAliasPlugin};
use bevy_mirrorball::{
    camera::{FramePixels, srgb_to_linear},
    headless,
};
use bevy_post_process::PostProcessPlugin;

/// Largest difference of a picture from the photograph where nothing virtual is: rounding, twice, and the end of a
/// shadow, where it darkens by less than one step.
const UNCHANGED: u8 = 3;
/// Largest difference between two pictures of the box and its shadow that should be alike.
const ALIKE: u8 = 4;
/// Smallest difference between the box and the photograph.
const SEEN: u8 = 30;
/// Edge of the box, and where it stands.
const BOX: f32 = 0.06;
const PLACE: Vec3 = Vec3::new(0.0, 0.5 * BOX, 0.0);
/// Beside the box, where its shadow is deep.
const IN_SHADOW: Vec3 = Vec3::new(0.04, 0.0, 0.0);
/// Where the top of the box is seen.
const ON_TOP: Vec3 = Vec3::new(0.0, BOX, 0.0);
/// Pixels around the box in which effects that look at neighbors may mix it with what is behind.
const EDGE: i32 = 3;
/// Width of the phantom desk. The camera sees more to the left and to the right: the photograph and nothing else.
const DESK_WIDTH: f32 = 0.5;

/// The scene with the effects' plugins, and without any effect.
struct Scene {
    desk: Desk,
    photo: Picture,
}

impl Scene {
    fn new() -> Option<Self> {
        Self::in_game(|_| ())
    }

    fn in_game(configure: impl FnOnce(&mut App)) -> Option<Self> {
        let photo = photograph();
        let app = drawing::app_with(|app| {
            app.add_plugins((PostProcessPlugin, FxaaPlugin, TemporalAntiAliasPlugin));
            configure(app);
        })?;
        let mut desk = Desk::in_game(app, photo.0.clone())?;
        let world = desk.app.world_mut();
        let sheet = world.resource_mut::<Assets<Mesh>>().add(Plane3d::default().mesh().size(DESK_WIDTH, 1.0));
        world.entity_mut(desk.plane).insert(Mesh3d(sheet));
        Some(Self { desk, photo })
    }

    /// The scene with the box.
    fn with_box() -> Option<Self> {
        let mut scene = Self::new()?;
        scene.add_box();
        Some(scene)
    }

    fn add_box(&mut self) -> Entity {
        self.desk.add_virtual(Cuboid::from_length(BOX), PLACE)
    }

    /// Adds components to the camera.
    fn on_camera(&mut self, bundle: impl Bundle) {
        self.desk.app.world_mut().entity_mut(self.desk.camera).insert(bundle);
    }

    fn add_material(&mut self, material: StandardMaterial) -> MeshMaterial3d<StandardMaterial> {
        MeshMaterial3d(self.desk.app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(material))
    }

    /// Another texture to draw into, for a second camera.
    fn add_target(&mut self) -> (Handle<Image>, RenderTarget) {
        headless::add_target(&mut self.desk.app, SIZE)
    }

    /// A picture after everything has followed.
    fn shoot(&mut self) -> Picture {
        headless::settle(&mut self.desk.app).expect("all shaders compile");
        Picture(self.desk.shoot().0)
    }

    /// Asserts that a picture shows the photograph, the box and its shadow as the picture without an effect does.
    fn check(&self, name: &str, shown: &Picture, plain: &Picture) {
        self.check_within(ALIKE, name, shown, plain);
    }

    /// The same with another limit for the box and its shadow.
    fn check_within(&self, alike: u8, name: &str, shown: &Picture, plain: &Picture) {
        let behind = self.behind(shown, plain);
        let (top, shadow) = (shown.difference_at(plain, ON_TOP), shown.difference_at(plain, IN_SHADOW));
        println!("{name}: behind {behind}, box {top}, shadow {shadow} of 255");
        shown.save(name);
        assert!(plain.difference_at(&self.photo, ON_TOP) >= SEEN, "{name}: there is no box to compare with");
        assert!(self.darkened(plain, IN_SHADOW) >= 10, "{name}: there is no shadow to compare with");
        assert!(behind <= UNCHANGED, "{name}: the camera's picture differs by {behind}/255");
        assert!(top <= alike && shadow <= alike, "{name}: box {top}/255, shadow {shadow}/255");
    }

    /// Largest difference from the photograph where the picture without an effect shows it, away from edges.
    fn behind(&self, shown: &Picture, plain: &Picture) -> u8 {
        let is_virtual: Vec<bool> =
            (0..shown.0.len() / 4).map(|i| plain.pixel_difference(&self.photo, i) >= SEEN).collect();
        let is_near = |i: usize| {
            let (x, y) = (i as i32 % SIZE.x as i32, i as i32 / SIZE.x as i32);
            let beside = (-EDGE..=EDGE).flat_map(|dy| (-EDGE..=EDGE).map(move |dx| IVec2::new(x + dx, y + dy)));
            let mut inside = beside.filter(|at| at.cmpge(IVec2::ZERO).all() && at.cmplt(SIZE.as_ivec2()).all());
            inside.any(|at| is_virtual[(at.y * SIZE.x as i32 + at.x) as usize])
        };
        let is_photo = |i: &usize| plain.pixel_difference(&self.photo, *i) <= 1 && !is_near(*i);
        let pixels = (0..shown.0.len() / 4).filter(is_photo);
        let count = pixels.clone().count();
        assert!(4 * count > shown.0.len() / 4, "{count} pixels show the photograph");
        pixels.map(|i| shown.pixel_difference(&self.photo, i)).max().unwrap_or(0)
    }

    /// Steps of green by which a picture is darker than the photograph at a place.
    fn darkened(&self, shown: &Picture, place: Vec3) -> i32 {
        i32::from(self.photo.at(place)[1]) - i32::from(shown.at(place)[1])
    }
}

/// 8-bit sRGB of the size of the desk's pictures.
#[derive(Clone, PartialEq)]
struct Picture(Vec<u8>);

impl Picture {
    /// The pixel that shows a place, with the camera where the desk's is.
    fn index(place: Vec3) -> usize {
        let pixel = INTRINSICS.center + INTRINSICS.focal * place.xz() / (HEIGHT - place.y);
        pixel.y as usize * SIZE.x as usize + pixel.x as usize
    }

    fn pixel(&self, index: usize) -> [u8; 3] {
        [0, 1, 2].map(|channel| self.0[4 * index + channel])
    }

    fn at(&self, place: Vec3) -> [u8; 3] {
        self.pixel(Self::index(place))
    }

    fn linear_at(&self, place: Vec3) -> Vec3 {
        Vec3::from(self.at(place).map(srgb_to_linear))
    }

    fn pixel_difference(&self, other: &Self, index: usize) -> u8 {
        let (a, b) = (self.pixel(index), other.pixel(index));
        (0..3).map(|channel| a[channel].abs_diff(b[channel])).max().unwrap_or(0)
    }

    fn difference_at(&self, other: &Self, place: Vec3) -> u8 {
        self.pixel_difference(other, Self::index(place))
    }

    fn difference(&self, other: &Self) -> u8 {
        (0..self.0.len() / 4).map(|i| self.pixel_difference(other, i)).max().unwrap_or(0)
    }

    /// Mean of red, green and blue.
    fn mean(&self) -> f32 {
        let sum: u32 = (0..self.0.len() / 4).flat_map(|i| self.pixel(i)).map(u32::from).sum();
        sum as f32 / (self.0.len() / 4 * 3) as f32
    }

    /// Keeps the picture to look at.
    fn save(&self, name: &str) {
        let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("composition_{name}.png"));
        let saved = image::save_buffer(&path, &self.0, SIZE.x, SIZE.y, image::ColorType::Rgba8);
        saved.expect("the target folder can be written");
    }
}

/// The shipped photograph of the desk, reduced to the size of the pictures. Darker than white, as photographs are that
/// are not clipped.
fn photograph() -> Picture {
    let photo = FramePixels::open("assets/desk/photo.jpg").expect("shipped");
    let step = photo.size.as_vec2() / SIZE.as_vec2();
    let pixels = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| Vec2::new(x as f32, y as f32)));
    let rgba = pixels.flat_map(|pixel| {
        let first = (pixel * step).as_ivec2();
        let edge = step.min_element() as i32;
        let block = (0..edge * edge).map(|i| photo.rgb8(first.x + i % edge, first.y + i / edge));
        let sum = block.fold([0u32; 3], |sum, rgb| [0, 1, 2].map(|c| sum[c] + u32::from(rgb[c])));
        let mean = sum.map(|sum| (sum / (edge * edge) as u32).min(235) as u8);
        [mean[0], mean[1], mean[2], 255]
    });
    Picture(rgba.collect())
}

#[test]
fn without_an_effect_the_photograph_the_box_and_its_shadow_are_there() {
    let Some(mut scene) = Scene::with_box() else { return };
    scene.photo.save("photograph");
    let plain = scene.shoot();
    scene.check("plain", &plain, &plain);
}
