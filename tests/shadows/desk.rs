//! A phantom desk seen from above, under a uniform sky.

use crate::drawing;
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{FramePixels, srgb_to_linear},
    environment_map::EnvironmentCube,
    prelude::*,
    probe::{EnvironmentFallback, UniformSky},
};

pub(crate) const SIZE: UVec2 = UVec2::new(96, 64);
pub(crate) const HEIGHT: f32 = 0.6;
pub(crate) const GRAY: u8 = 150;
pub(crate) const SKY: f32 = 0.4;

pub(crate) const INTRINSICS: Intrinsics = Intrinsics::new(Vec2::splat(80.0), Vec2::new(48.0, 32.0), SIZE);

/// A camera above a phantom desk, a probe in view, a dome, and a picture with a slight pattern.
pub(crate) struct Desk {
    pub(crate) app: App,
    pub(crate) picture: Handle<Image>,
    pub(crate) camera: Entity,
    pub(crate) dome: Entity,
    pub(crate) probe: Entity,
    pub(crate) plane: Entity,
}

impl Desk {
    /// The desk in a measured room of one radiance, under a dome without bounced light: shadows are those of the sky.
    pub(crate) fn new() -> Option<Self> {
        Self::in_measured_room(desk_picture())
    }

    /// The same, shown in another frame.
    pub(crate) fn in_measured_room(rgba: Vec<u8>) -> Option<Self> {
        Self::in_game(drawing::app()?, rgba)
    }

    /// The same in an app with what a game adds.
    pub(crate) fn in_game(app: App, rgba: Vec<u8>) -> Option<Self> {
        let mut desk = Self::without_light(app, rgba)?;
        let sky = UniformSky { radiance: Some(Vec3::splat(SKY)) };
        let ball = (LightProbeSphere::default(), sky, Transform::from_xyz(0.2, 0.05, 0.1));
        desk.app.world_mut().entity_mut(desk.probe).insert(ball);
        desk.app.world_mut().entity_mut(desk.dome).insert(ShadowDomeLight { surfels: 0, ..default() });
        Some(desk)
    }

    /// The same with bounced light.
    pub(crate) fn with_bounces(mut self) -> Self {
        self.app.world_mut().entity_mut(self.dome).insert(ShadowDomeLight::default());
        self
    }

    /// Without ball and dome: their entities are empty.
    pub(crate) fn in_unknown_room(rgba: Vec<u8>) -> Option<Self> {
        Self::without_light(drawing::app()?, rgba)
    }

    fn without_light(mut app: App, rgba: Vec<u8>) -> Option<Self> {
        let (picture, target) = bevy_mirrorball::headless::add_target(&mut app, SIZE);
        let pixels = FramePixels::new(SIZE, rgba).expect("as many bytes as the size says");
        let feed = CameraFeed::pixels(pixels).with_pace(FeedPace::Lockstep);
        let pose = Transform::from_xyz(0.0, HEIGHT, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z);
        let camera = app.world_mut().spawn((ArCamera::new(INTRINSICS), pose, feed, target, Msaa::Off)).id();
        let [probe, dome] = [(); 2].map(|()| app.world_mut().spawn_empty().id());
        let mut desk = Self { app, picture, camera, dome, probe, plane: Entity::PLACEHOLDER };
        let sheet = Plane3d::default().mesh().size(2.0, 2.0).build();
        desk.plane = desk.add(sheet, Vec3::ZERO, PhantomObject { casts: false, ..default() });
        Some(desk)
    }

    /// Takes the ball away, and what would light the scene in its place.
    pub(crate) fn forget_light(&mut self) {
        self.app.world_mut().despawn(self.probe);
        self.forget_fallback();
    }

    /// Takes away what lights the scene where nothing is measured.
    pub(crate) fn forget_fallback(&mut self) {
        self.app.world_mut().entity_mut(self.camera).remove::<(EnvironmentFallback, EnvironmentCube)>();
    }

    pub(crate) fn add(&mut self, mesh: impl Into<Mesh>, place: Vec3, extra: impl Bundle) -> Entity {
        let mesh = self.app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        self.app.world_mut().spawn((Mesh3d(mesh), Transform::from_translation(place), extra)).id()
    }

    pub(crate) fn add_virtual(&mut self, mesh: impl Into<Mesh>, place: Vec3) -> Entity {
        let material = StandardMaterial { base_color: Color::srgb(0.9, 0.5, 0.3), ..default() };
        let material = self.app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(material);
        self.add(mesh, place, MeshMaterial3d(material))
    }

    pub(crate) fn shoot(&mut self) -> Shot {
        // Roles and materials follow within three frames, shadow maps in four times sixteen directions.
        for _ in 0..8 {
            self.app.update();
        }
        Shot(bevy_mirrorball::headless::read_texture(&mut self.app, &self.picture).expect("the picture comes back"))
    }
}

pub(crate) fn desk_picture() -> Vec<u8> {
    (0..SIZE.x * SIZE.y).flat_map(|i| [GRAY + (i % 3) as u8, GRAY - (i % 5) as u8, GRAY, 255]).collect()
}

#[derive(PartialEq)]
pub(crate) struct Shot(pub(crate) Vec<u8>);

impl Shot {
    pub(crate) fn at(&self, place: Vec3) -> usize {
        let pixel = INTRINSICS.center + INTRINSICS.focal * place.xz() / (HEIGHT - place.y);
        4 * (pixel.y as usize * SIZE.x as usize + pixel.x as usize)
    }

    /// Steps of green by which the picture is darker than the camera's at a place.
    pub(crate) fn darkened(&self, place: Vec3) -> i32 {
        let at = self.at(place) + 1;
        i32::from(desk_picture()[at]) - i32::from(self.0[at])
    }

    /// Share of the camera's linear green left at a place.
    pub(crate) fn ratio(&self, place: Vec3) -> f32 {
        let at = self.at(place) + 1;
        srgb_to_linear(self.0[at]) / srgb_to_linear(desk_picture()[at])
    }

    /// The same of all colors.
    pub(crate) fn color_ratio(&self, place: Vec3) -> Vec3 {
        let (at, before) = (self.at(place), desk_picture());
        let ratio = |channel: usize| srgb_to_linear(self.0[at + channel]) / srgb_to_linear(before[at + channel]);
        Vec3::new(ratio(0), ratio(1), ratio(2))
    }

    /// Largest difference over the whole picture.
    pub(crate) fn difference(&self, other: &[u8]) -> u8 {
        self.0.iter().zip(other).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
    }
}
