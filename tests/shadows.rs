//! What dome shadows do to a picture of a desk seen from above, under a sky of one radiance.

mod gpu;

use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels, srgb_to_linear},
    environment::EnvironmentPlugin,
    materials::{ImageBasedMaterial, MaterialsPlugin},
    offscreen,
    prelude::*,
    probe::{ProbePlugin, UniformSky},
    shadows::ShadowsPlugin,
    stage::StagePlugin,
};

/// Rounding to 8 bits.
const SAME: u8 = 1;
/// 64 directions stand for 2.8° each around; the steps of a dome's penumbra are about this large.
const RATIO_TOLERANCE: f32 = 0.04;
/// The least difference that counts as a shadow, in sRGB steps: well above rounding.
const DARKER: u8 = 6;

const SIZE: UVec2 = UVec2::new(96, 64);
const HEIGHT: f32 = 0.6;
const GRAY: u8 = 150;
const SKY: f32 = 0.4;

fn intrinsics() -> Intrinsics {
    Intrinsics { focal: Vec2::splat(80.0), center: Vec2::new(48.0, 32.0), size: SIZE }
}

/// A camera above a phantom desk, a probe in view, a dome, and a picture with a slight pattern.
struct Desk {
    app: App,
    picture: Handle<Image>,
    dome: Entity,
    plane: Entity,
}

impl Desk {
    fn new() -> Option<Self> {
        let mut app = gpu::app(|app| {
            app.add_plugins((
                CameraPlugin,
                StagePlugin,
                ProbePlugin,
                EnvironmentPlugin,
                ShadowsPlugin,
                MaterialsPlugin,
            ));
        })?;
        let (picture, target) = offscreen::add_target(&mut app, SIZE);
        let pixels = FramePixels::new(SIZE, desk_picture()).expect("as many bytes as the size says");
        let feed = CameraFeed::pixels(pixels).with_pace(FeedPace::Lockstep);
        let pose = Transform::from_xyz(0.0, HEIGHT, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z);
        app.world_mut().spawn((ArCamera::new(intrinsics()), pose, feed, target, Msaa::Off));
        let sky = UniformSky { radiance: Some(Vec3::splat(SKY)) };
        app.world_mut().spawn((LightProbeSphere::default(), sky, Transform::from_xyz(0.2, 0.05, 0.1)));
        let dome = app.world_mut().spawn(ShadowDomeLight::default()).id();
        let mut desk = Self { app, picture, dome, plane: Entity::PLACEHOLDER };
        let sheet = Plane3d::default().mesh().size(2.0, 2.0).build();
        desk.plane = desk.add(sheet, Vec3::ZERO, PhantomObject { casts: false, ..default() });
        Some(desk)
    }

    fn add(&mut self, mesh: impl Into<Mesh>, place: Vec3, extra: impl Bundle) -> Entity {
        let mesh = self.app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        self.app.world_mut().spawn((Mesh3d(mesh), Transform::from_translation(place), extra)).id()
    }

    fn add_virtual(&mut self, mesh: impl Into<Mesh>, place: Vec3) -> Entity {
        let material = StandardMaterial { base_color: Color::srgb(0.9, 0.5, 0.3), ..default() };
        let material = self.app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(material);
        self.add(mesh, place, MeshMaterial3d(material))
    }

    fn shoot(&mut self) -> Shot {
        // Roles, materials and shadow maps follow within three frames.
        for _ in 0..3 {
            self.app.update();
        }
        Shot(offscreen::read_texture(&mut self.app, &self.picture).expect("the picture comes back"))
    }
}

fn desk_picture() -> Vec<u8> {
    (0..SIZE.x * SIZE.y).flat_map(|i| [GRAY + (i % 3) as u8, GRAY - (i % 5) as u8, GRAY, 255]).collect()
}

#[derive(PartialEq)]
struct Shot(Vec<u8>);

impl Shot {
    fn at(&self, place: Vec3) -> usize {
        let pixel = intrinsics().center + intrinsics().focal * place.xz() / (HEIGHT - place.y);
        4 * (pixel.y as usize * SIZE.x as usize + pixel.x as usize)
    }

    /// Steps of green by which the picture is darker than the camera's at a place.
    fn darkened(&self, place: Vec3) -> i32 {
        let at = self.at(place) + 1;
        i32::from(desk_picture()[at]) - i32::from(self.0[at])
    }

    /// Share of the camera's linear green left at a place.
    fn ratio(&self, place: Vec3) -> f32 {
        let at = self.at(place) + 1;
        srgb_to_linear(self.0[at]) / srgb_to_linear(desk_picture()[at])
    }

    /// Largest difference over the whole picture.
    fn difference(&self, other: &[u8]) -> u8 {
        self.0.iter().zip(other).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
    }
}

#[test]
fn real_things_alone_leave_the_picture_as_it_is() {
    let Some(mut desk) = Desk::new() else { return };
    let empty = desk.shoot().difference(&desk_picture());
    desk.add(Cuboid::new(0.1, 0.1, 0.1), Vec3::new(-0.1, 0.05, 0.0), PhantomObject::default());
    let with_box = desk.shoot().difference(&desk_picture());
    println!("nothing virtual: off by {empty}/255, with a real box by {with_box}/255");
    assert!(empty <= SAME && with_box <= SAME);
}

#[test]
fn a_virtual_box_shadows_the_desk_around_it_until_the_dome_or_the_receiver_goes() {
    let Some(mut desk) = Desk::new() else { return };
    let cube = desk.add_virtual(Cuboid::new(0.06, 0.06, 0.06), Vec3::new(-0.15, 0.03, 0.0));
    let (near, far) = (Vec3::new(-0.105, 0.0, 0.0), Vec3::new(0.3, 0.0, 0.2));
    let shadowed = desk.shoot();
    println!("1.5 cm beside the box {} steps darker, 50 cm away {}", shadowed.darkened(near), shadowed.darkened(far));
    assert!(shadowed.darkened(near) >= DARKER.into());
    assert!(shadowed.darkened(far).abs() <= SAME.into());

    desk.app.world_mut().entity_mut(desk.plane).insert(PhantomObject { casts: false, receives: false, ..default() });
    let not_receiving = desk.shoot();
    println!("not receiving: {} steps", not_receiving.darkened(near));
    assert!(not_receiving.darkened(near).abs() <= SAME.into());
    desk.app.world_mut().entity_mut(desk.plane).insert(PhantomObject { casts: false, ..default() });
    let again = desk.shoot().difference(&shadowed.0);
    assert!(again <= SAME, "receiving again: off by {again}");

    let dome = desk.app.world().get::<ShadowDomeLight>(desk.dome).expect("it is a dome").clone();
    desk.app.world_mut().entity_mut(desk.dome).remove::<ShadowDomeLight>();
    let without_dome = desk.shoot();
    println!("without dome: {} steps", without_dome.darkened(near));
    assert!(without_dome.darkened(near).abs() <= SAME.into());
    desk.app.world_mut().entity_mut(desk.dome).insert(dome);
    let again = desk.shoot().difference(&shadowed.0);
    assert!(again <= SAME, "a dome again: off by {again}");

    desk.app.world_mut().despawn(cube);
    let empty = desk.shoot().difference(&desk_picture());
    println!("box gone: off by {empty}/255");
    assert!(empty <= SAME);
}

#[test]
fn a_wall_takes_the_light_of_the_sky_behind_it() {
    const WALL_HEIGHT: f32 = 0.5;
    const FOOT: f32 = -0.25;
    let Some(mut desk) = Desk::new() else { return };
    desk.add_virtual(Cuboid::new(0.02, WALL_HEIGHT, 3.0), Vec3::new(FOOT - 0.01, 0.5 * WALL_HEIGHT, 0.0));
    let shot = desk.shoot();
    for away in [0.015, 0.05, 0.1, 0.2, 0.4] {
        // A long wall hides half of (1 − sin of the angle between its upper edge and the zenith) of a uniform sky.
        let expected = 0.5 * (1.0 + (away / WALL_HEIGHT).atan().sin());
        let ratio = shot.ratio(Vec3::new(FOOT + away, 0.0, 0.03));
        println!("{away} m from the wall: {ratio:.3} of the light, expected {expected:.3}");
        assert!((ratio - expected).abs() <= RATIO_TOLERANCE);
    }
}

#[test]
fn a_real_box_hides_what_is_behind_it() {
    let Some(mut desk) = Desk::new() else { return };
    let hidden = desk.add_virtual(Cuboid::new(0.05, 0.02, 0.05), Vec3::new(-0.1, 0.01, 0.0));
    assert!(desk.shoot().difference(&desk_picture()) > DARKER, "in view at first");
    let phantom = PhantomObject::default();
    desk.add(Cuboid::new(0.14, 0.04, 0.14), Vec3::new(-0.1, 0.1, 0.0), phantom);
    let shot = desk.shoot();
    let top = (-6..=6).flat_map(|x| (-6..=6).map(move |z| Vec3::new(-0.1 + 0.01 * x as f32, 0.12, 0.01 * z as f32)));
    let worst = top.map(|place| shot.darkened(place).abs()).max().unwrap_or(0);
    println!("above what is hidden: off by {worst}/255");
    assert!(worst <= SAME.into());
    desk.app.world_mut().despawn(hidden);
}

#[test]
fn a_surface_under_the_open_sky_looks_as_without_dome() {
    let Some(mut desk) = Desk::new() else { return };
    let ball = Sphere::new(0.06).mesh().ico(12).expect("few enough");
    // The whole slab, and the ball down to where its sides turn away from the camera.
    for (mesh, place, top, reach) in
        [(ball, -0.12, 0.06, 0.04), (Cuboid::new(0.1, 0.02, 0.1).into(), 0.02, 0.01, 0.045)]
    {
        let center = Vec3::new(place, 0.1, -0.05);
        let thing = desk.add_virtual(mesh, center);
        let under_dome = desk.shoot();
        let is_shadowed = desk.app.world().entity(thing).contains::<MeshMaterial3d<ImageBasedMaterial>>();
        assert!(is_shadowed, "the dome has taken over");
        desk.app.world_mut().entity_mut(thing).insert(SurfaceStyle::Engine);
        let engine = desk.shoot();
        let at = engine.at(center + top * Vec3::Y);
        assert!(engine.0[at] > engine.0[at + 2].saturating_add(DARKER), "an orange thing is in view");
        let places = (-9..=9).flat_map(|x| (-9..=9).map(move |z| Vec3::new(x as f32, 0.0, z as f32) / 9.0));
        let places = places.filter(|p| reach > 0.04 || p.length() < 1.0).map(|p| center + top * Vec3::Y + reach * p);
        let worst = places.map(|p| under_dome.0[under_dome.at(p)].abs_diff(engine.0[engine.at(p)])).max().unwrap_or(0);
        let everywhere = under_dome.difference(&engine.0);
        println!("dome against engine: off by {worst}/255, anywhere in the picture {everywhere}/255");
        assert!(worst <= SAME);
        desk.app.world_mut().despawn(thing);
    }
}
