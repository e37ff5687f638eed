//! Toon surfaces against the light that is known: one lamp, a sky of known irradiance, the shadow of a wall.

mod gpu;

use bevy::{
    asset::RenderAssetUsages,
    camera::{Exposure, RenderTarget},
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    image::ImageSampler,
    mesh::{
        VertexAttributeValues,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat, TextureViewDescriptor, TextureViewDimension},
};
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels, srgb_to_linear},
    materials::{ImageBasedMaterial, MaterialsPlugin, OutlineMaterial, ToonMaterial},
    offscreen,
    phantom::PhantomPlugin,
    prefilter::PrefilterPlugin,
    prelude::*,
    probe::{ProbePlugin, UniformSky},
    shadows::ShadowsPlugin,
    unwrap::UnwrapPlugin,
};

/// Rounding to 8 bits, half floats of the filtered sky and its 16² texels.
const COLOR_TOLERANCE: f32 = 0.02;
/// Bands are not compared this near their edges (in bands): the engine's diffuse term is Lambert's to 3 % of the light.
const EDGE: f32 = 0.16;
/// Share of a ball's pixels that may be mixtures at band edges.
const MIXED: f32 = 0.1;

const SIZE: UVec2 = UVec2::new(96, 96);
/// Half the camera's vertical extent in metres; the camera is orthographic, so pixels are normals of a ball.
const EXTENT: f32 = 0.6;
const RADIUS: f32 = 0.5;
const BACKGROUND: Color = Color::linear_rgb(0.0, 0.0, 0.5);

/// Shaders have arrived when this many frames of 1 ms bring none.
const QUIET_FRAMES: u32 = 50;

#[derive(Resource)]
struct KeptShaders(#[expect(dead_code, reason = "keeps the assets loaded")] [Handle<Shader>; 4]);

/// Loads all shaders beforehand: in a busy machine the first pictures would lack what is not there yet.
fn load_shaders(app: &mut App) {
    let assets = app.world().resource::<AssetServer>().clone();
    let shaders = ["image_based", "outline/outline", "phantom", "toon"]
        .map(|name| assets.load(format!("embedded://bevy_mirrorball/materials/{name}.wgsl")));
    let (mut quiet, mut known) = (0, 0);
    while quiet < QUIET_FRAMES || !shaders.iter().all(|shader| assets.is_loaded_with_dependencies(shader)) {
        app.update();
        std::thread::sleep(std::time::Duration::from_millis(1));
        let count = app.world().resource::<Assets<Shader>>().len();
        quiet = if count == known { quiet + 1 } else { 0 };
        known = count;
    }
    app.insert_resource(KeptShaders(shaders));
}

/// A ball before a camera without tone mapping, and no light at all.
struct Studio {
    app: App,
    picture: Handle<Image>,
    camera: Entity,
    ball: Entity,
}

fn ball_mesh() -> Mesh {
    Sphere::new(RADIUS).mesh().ico(24).expect("few enough")
}

impl Studio {
    fn new(style: SurfaceStyle) -> Option<Self> {
        let mut app = gpu::app(|app| {
            app.add_plugins((
                CameraPlugin,
                PhantomPlugin,
                ProbePlugin,
                UnwrapPlugin,
                PrefilterPlugin,
                ShadowsPlugin,
                MaterialsPlugin,
            ));
        })?;
        load_shaders(&mut app);
        app.insert_resource(ClearColor(BACKGROUND));
        let (picture, target) = offscreen::add_target(&mut app, SIZE);
        let projection = OrthographicProjection {
            scaling_mode: bevy::camera::ScalingMode::FixedVertical { viewport_height: 2.0 * EXTENT },
            ..OrthographicProjection::default_3d()
        };
        let camera = (
            Camera3d::default(),
            Projection::Orthographic(projection),
            Transform::from_xyz(0.0, 0.0, 2.0),
            (Tonemapping::None, DebandDither::Disabled, Msaa::Off),
            AmbientLight { brightness: 0.0, ..default() },
            target,
        );
        let camera = app.world_mut().spawn(camera).id();
        let mut studio = Self { app, picture, camera, ball: Entity::PLACEHOLDER };
        studio.ball = studio.add(ball_mesh(), Color::WHITE, style);
        Some(studio)
    }

    fn add(&mut self, mesh: impl Into<Mesh>, color: Color, extra: impl Bundle) -> Entity {
        let world = self.app.world_mut();
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
        let material = world.resource_mut::<Assets<StandardMaterial>>().add(color);
        world.spawn((Mesh3d(mesh), MeshMaterial3d(material), extra)).id()
    }

    /// A lamp at infinity that makes white paper facing it show `radiance` in the frame buffer.
    fn add_lamp(&mut self, dir: Vec3, radiance: f32) {
        let illuminance = radiance * std::f32::consts::PI / Exposure::default().exposure();
        let lamp = DirectionalLight { illuminance, ..default() };
        self.app.world_mut().spawn((lamp, Transform::default().looking_to(-dir, Vec3::Y)));
    }

    /// A sky in which white paper facing `n` shows a mixture of two colors, `bright` at `dir` and `dark` opposite.
    fn add_sky(&mut self, dir: Vec3, dark: Vec3, bright: Vec3) {
        // The cosine sum of a constant is itself, that of a cosine two thirds of it.
        let radiance = |d: Vec3| 0.5 * (dark + bright) + 0.75 * (bright - dark) * d.dot(dir);
        let source = self.app.world_mut().resource_mut::<Assets<Image>>().add(cube(radiance));
        self.app.world_mut().entity_mut(self.camera).insert(LiveEnvironment::new(source));
    }

    fn set_style(&mut self, style: SurfaceStyle) {
        self.app.world_mut().entity_mut(self.ball).insert(style);
    }

    fn shoot(&mut self) -> Picture {
        // Materials, outlines and environments follow within three frames.
        for _ in 0..3 {
            self.app.update();
        }
        Picture(offscreen::read_texture(&mut self.app, &self.picture).expect("the picture comes back"))
    }

    fn count<C: Component>(&mut self) -> usize {
        let world = self.app.world_mut();
        world.query::<&C>().iter(world).count()
    }
}

fn cube(radiance: impl Fn(Vec3) -> Vec3) -> Image {
    const EDGE: u32 = 32;
    let texels = (0..6 * EDGE * EDGE).flat_map(|i| {
        let (face, row, column) = (i / (EDGE * EDGE), i / EDGE % EDGE, i % EDGE);
        let at = |k: u32| (2.0 * k as f32 + 1.0) / EDGE as f32 - 1.0;
        let (x, y) = (at(column), at(row));
        // Layers +X, −X, +Y, −Y, +Z, −Z of a left-handed frame: the world's z is the negative.
        let dir = match face {
            0 => Vec3::new(1.0, -y, x),
            1 => Vec3::new(-1.0, -y, -x),
            2 => Vec3::new(x, 1.0, -y),
            3 => Vec3::new(x, -1.0, y),
            4 => Vec3::new(x, -y, -1.0),
            _ => Vec3::new(-x, -y, 1.0),
        };
        radiance(dir.normalize()).extend(1.0).to_array().into_iter().flat_map(|v| half::f16::from_f32(v).to_le_bytes())
    });
    let extent = Extent3d { width: EDGE, height: EDGE, depth_or_array_layers: 6 };
    let (format, usage) = (TextureFormat::Rgba16Float, RenderAssetUsages::RENDER_WORLD);
    let mut image = Image::new(extent, TextureDimension::D2, texels.collect(), format, usage);
    image.texture_view_descriptor =
        Some(TextureViewDescriptor { dimension: Some(TextureViewDimension::Cube), ..default() });
    image.sampler = ImageSampler::linear();
    image
}

#[derive(PartialEq)]
struct Picture(Vec<u8>);

impl Picture {
    fn linear(&self, pixel: UVec2) -> Vec3 {
        let at = 4 * (pixel.y * SIZE.x + pixel.x) as usize;
        Vec3::from_array([0, 1, 2].map(|c| srgb_to_linear(self.0[at + c])))
    }

    /// Largest difference over the whole picture.
    fn difference(&self, other: &Self) -> u8 {
        self.0.iter().zip(&other.0).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
    }

    /// Pixels of a row's left half that have the outline's color (green).
    fn outline_in_row(&self, row: u32, columns: std::ops::Range<u32>) -> usize {
        columns.filter(|x| self.linear(UVec2::new(*x, row)).y > 0.9).count()
    }
}

/// Pixels well inside the ball and the ball's normal there.
fn normals() -> impl Iterator<Item = (UVec2, Vec3)> {
    (0..SIZE.x * SIZE.y).filter_map(|i| {
        let pixel = UVec2::new(i % SIZE.x, i / SIZE.x);
        let across = (pixel.as_vec2() + 0.5) / (0.5 * SIZE.as_vec2()) - 1.0;
        let normal = Vec2::new(across.x, -across.y) * (EXTENT / RADIUS);
        let depth = 1.0 - normal.length_squared();
        (depth > 0.15).then(|| (pixel, normal.extend(depth.sqrt())))
    })
}

/// The twin of `band_level` in toon.wgsl. `None` near an edge.
fn band_level(position: f32, bands: u32) -> Option<f32> {
    let scaled = position * bands as f32;
    let is_near_edge = (1..bands).any(|edge| (scaled - edge as f32).abs() < EDGE);
    let band = scaled.floor().clamp(0.0, bands as f32 - 1.0);
    let lowest = 0.5 / bands as f32;
    (!is_near_edge).then_some(lowest + (1.0 - lowest) * band / (bands as f32 - 1.0))
}

fn toon(bands: u32) -> SurfaceStyle {
    SurfaceStyle::Toon(ToonStyle { bands, highlight: false, outline_width: 0.0, ..default() })
}

/// Asserts that the ball shows the bands of light whose position between `dark` and `bright` is known per normal.
fn assert_bands(picture: &Picture, bands: u32, dark: Vec3, bright: Vec3, position: impl Fn(Vec3) -> f32) {
    let mut seen: Vec<(Vec3, u32)> = Vec::new();
    let mut worst = 0.0_f32;
    let mut total = 0;
    for (pixel, normal) in normals() {
        total += 1;
        let color = picture.linear(pixel);
        match seen.iter_mut().find(|(known, _)| known.abs_diff_eq(color, 0.008)) {
            Some((_, count)) => *count += 1,
            None => seen.push((color, 1)),
        }
        if let Some(level) = band_level(position(normal), bands) {
            worst = worst.max((color - dark.lerp(bright, level)).abs().max_element());
        }
    }
    let flat: Vec<_> = seen.iter().filter(|(_, count)| *count as f32 > 0.01 * total as f32).collect();
    let mixed = total - flat.iter().map(|(_, count)| count).sum::<u32>();
    println!("{bands} bands: {flat:?}, {mixed} of {total} pixels mixed, off by {worst:.4}");
    assert_eq!(flat.len(), bands as usize);
    assert!(mixed as f32 <= MIXED * total as f32 && worst <= COLOR_TOLERANCE);
}

#[test]
fn one_lamp_shows_exactly_the_bands_asked_for() {
    const RADIANCE: f32 = 0.8;
    let Some(mut studio) = Studio::new(toon(3)) else { return };
    let unlit = studio.shoot();
    assert_eq!(unlit.linear(SIZE / 2), Vec3::ZERO, "without any light");
    let dir = Vec3::new(0.8, 0.5, 0.3).normalize();
    studio.add_lamp(dir, RADIANCE);
    for bands in [2, 3, 5] {
        studio.set_style(toon(bands));
        let picture = studio.shoot();
        assert_bands(&picture, bands, Vec3::ZERO, Vec3::splat(RADIANCE), |normal| normal.dot(dir).max(0.0));
    }
    let five = studio.shoot();
    studio.set_style(toon(99));
    assert_eq!(studio.shoot().difference(&five), 0, "99 bands are 5");
}

#[test]
fn a_glossy_ball_has_a_highlight_where_it_mirrors_the_lamp() {
    let style = |highlight| SurfaceStyle::Toon(ToonStyle { highlight, outline_width: 0.0, ..default() });
    let Some(mut studio) = Studio::new(style(false)) else { return };
    let gray = studio.add(ball_mesh(), Color::linear_rgb(0.2, 0.2, 0.2), style(false));
    studio.app.world_mut().despawn(std::mem::replace(&mut studio.ball, gray));
    let dir = Vec3::new(0.5, 0.4, 0.6).normalize();
    studio.add_lamp(dir, 0.8);
    let matte = studio.shoot();
    studio.set_style(style(true));
    let glossy = studio.shoot();
    let spot: Vec<Vec3> =
        normals().filter(|(pixel, _)| glossy.linear(*pixel).x > matte.linear(*pixel).x + 0.1).map(|(_, n)| n).collect();
    let center = spot.iter().sum::<Vec3>().normalize_or_zero();
    let expected = (dir + Vec3::Z).normalize();
    let radius = spot.iter().map(|n| n.angle_between(expected).to_degrees()).fold(0.0, f32::max);
    println!("{} pixels around {center}, expected {expected}, {radius:.1}° from there at most", spot.len());
    // Phong's lobe of 19.9 is half as high 15° from its middle, which normals reach by half that turn.
    assert!(center.distance(expected) < 0.03 && (6.5..9.0).contains(&radius));
}

#[test]
fn a_colored_environment_colors_the_bands() {
    let (dark, bright) = (Vec3::new(0.15, 0.15, 0.3), Vec3::new(0.7, 0.6, 0.3));
    for dir in [Vec3::new(-0.6, 0.7, 0.2).normalize(), Vec3::new(0.9, -0.3, 0.1).normalize()] {
        let Some(mut studio) = Studio::new(toon(3)) else { return };
        studio.add_sky(dir, dark, bright);
        for bands in [2, 3, 5] {
            studio.set_style(toon(bands));
            assert_bands(&studio.shoot(), bands, dark, bright, |normal| 0.5 + 0.5 * normal.dot(dir));
        }
    }
}

#[test]
fn the_material_is_kept_and_its_changes_are_followed() {
    let Some(mut studio) = Studio::new(toon(2)) else { return };
    let original = studio.app.world().get::<MeshMaterial3d<StandardMaterial>>(studio.ball).expect("not exchanged yet");
    let original = original.id();
    studio.add_lamp(Vec3::Z, 0.5);
    assert!((studio.shoot().linear(SIZE / 2) - 0.5).abs().max_element() < COLOR_TOLERANCE);
    let mut materials = studio.app.world_mut().resource_mut::<Assets<StandardMaterial>>();
    let mut material = materials.get_mut(original).expect("the toon keeps it");
    material.base_color = Color::linear_rgb(1.0, 0.5, 0.0);
    material.emissive = LinearRgba::rgb(0.0, 0.0, 0.25);
    material.emissive_exposure_weight = 0.0;
    material.metallic = 1.0;
    drop(material);
    let color = studio.shoot().linear(SIZE / 2);
    println!("orange that glows blue: {color}");
    assert!((color - Vec3::new(0.5, 0.25, 0.25)).abs().max_element() < COLOR_TOLERANCE);
}

#[test]
fn styles_change_at_run_time_and_leave_nothing_behind() {
    let style = SurfaceStyle::Toon(default());
    let Some(mut studio) = Studio::new(style) else { return };
    studio.add_lamp(Vec3::new(0.8, 0.5, 0.3), 0.8);
    studio.app.world_mut().spawn(ShadowDomeLight { directions: 4, resolution: 32, ..default() });
    let toon = studio.shoot();
    assert_eq!(studio.count::<MeshMaterial3d<OutlineMaterial>>(), 1);
    studio.set_style(SurfaceStyle::ImageBased);
    let smooth = studio.shoot();
    assert_eq!(studio.count::<MeshMaterial3d<ImageBasedMaterial>>(), 1);
    studio.set_style(SurfaceStyle::Engine);
    let engine = studio.shoot();
    assert_eq!(studio.count::<MeshMaterial3d<StandardMaterial>>(), 1);
    assert_eq!(studio.count::<MeshMaterial3d<OutlineMaterial>>(), 0);
    assert!(smooth.difference(&engine) <= 1, "nothing shadows the lamp");
    assert!(toon.difference(&engine) > 20, "a toon looks different");
    assert_eq!(studio.app.world().resource::<Assets<ToonMaterial>>().len(), 0, "a toon material was left");
    assert_eq!(studio.app.world().resource::<Assets<OutlineMaterial>>().len(), 0, "an outline was left");
    studio.set_style(style);
    assert_eq!(studio.shoot().difference(&toon), 0);

    // A toon that turns out to be real, and one that goes.
    studio.app.world_mut().entity_mut(studio.ball).insert(PhantomObject::default());
    studio.shoot();
    assert_eq!(studio.count::<Mesh3d>(), 1, "a phantom has no outline");
    studio.app.world_mut().despawn(studio.ball);
    let ball = studio.add(ball_mesh(), Color::WHITE, style);
    assert_eq!(studio.shoot().difference(&toon), 0);
    studio.app.world_mut().despawn(ball);
    studio.shoot();
    assert_eq!(studio.count::<Mesh3d>(), 0, "the outline goes with its mesh");
}

#[test]
fn a_style_on_a_root_counts_for_meshes_spawned_below_it() {
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    let root = studio.app.world_mut().spawn((toon(3), Transform::default(), Visibility::default())).id();
    studio.shoot();
    let below = studio.add(ball_mesh(), Color::WHITE, ChildOf(root));
    let other = studio.add(ball_mesh(), Color::WHITE, (ChildOf(below), SurfaceStyle::Engine));
    studio.shoot();
    let is_toon =
        |studio: &Studio, mesh: Entity| studio.app.world().entity(mesh).contains::<MeshMaterial3d<ToonMaterial>>();
    assert_eq!([studio.ball, below, other].map(|mesh| is_toon(&studio, mesh)), [false, true, false]);
    studio.app.world_mut().entity_mut(root).remove::<SurfaceStyle>();
    studio.shoot();
    assert!(!is_toon(&studio, below), "the style was removed");
}

#[test]
fn the_outline_is_a_ring_of_its_width() {
    let Some(mut studio) = Studio::new(toon(3)) else { return };
    let green = Color::linear_rgb(0.0, 1.0, 0.0);
    for wanted in [0, 2, 5, 0, 1] {
        studio.set_style(SurfaceStyle::Toon(ToonStyle {
            outline_width: wanted as f32,
            outline_color: green,
            ..default()
        }));
        let picture = studio.shoot();
        let row = SIZE.y / 2;
        let widths = [0..SIZE.x / 2, SIZE.x / 2..SIZE.x].map(|columns| picture.outline_in_row(row, columns));
        let ring: usize = (0..SIZE.y).map(|row| picture.outline_in_row(row, 0..SIZE.x)).sum();
        let radius = RADIUS / EXTENT * 0.5 * SIZE.y as f32;
        let expected = std::f32::consts::PI * ((radius + wanted as f32).powi(2) - radius.powi(2));
        println!("{wanted} pixels wanted: {widths:?} at the sides, {ring} in all, expected {expected:.0}");
        // A pixel belongs to the ring or not; the ball is a polyhedron.
        assert!(widths.iter().all(|width| width.abs_diff(wanted) <= usize::from(wanted > 0)));
        assert!((ring as f32 - expected).abs() <= 0.15 * expected + 1.0);
    }
}

#[test]
fn the_outline_of_a_box_has_no_gaps_at_its_corners() {
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    studio.app.world_mut().despawn(studio.ball);
    let style = ToonStyle { outline_width: 4.0, outline_color: Color::linear_rgb(0.0, 1.0, 0.0), ..default() };
    let turned = Transform::from_rotation(Quat::from_euler(EulerRot::YXZ, 0.6, 0.5, 0.2));
    studio.add(Cuboid::from_length(0.5), Color::WHITE, (SurfaceStyle::Toon(style), turned));
    let picture = studio.shoot();
    // Walking from the box outwards in any direction, one meets the outline before the background.
    for step in 0..180 {
        let dir = Vec2::from_angle(step as f32 * std::f32::consts::TAU / 180.0);
        let first_outside = (0..SIZE.x / 2)
            .map(|t| picture.linear((0.5 * SIZE.as_vec2() + dir * t as f32).as_uvec2()))
            .find(|color| color.y > 0.9 || color.z > 0.4);
        assert!(first_outside.is_some_and(|color| color.y > 0.9), "a gap at {}°", 2 * step);
    }
}

#[test]
fn the_outline_follows_bones() {
    const SHIFT: f32 = 0.3;
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    studio.app.world_mut().despawn(studio.ball);
    let style = ToonStyle { outline_width: 3.0, outline_color: Color::linear_rgb(0.0, 1.0, 0.0), ..default() };
    let small = Sphere::new(0.2).mesh().ico(12).expect("few enough");
    let count = small.count_vertices();
    let small = small
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_INDEX, VertexAttributeValues::Uint16x4(vec![[0; 4]; count]))
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, vec![[1.0, 0.0, 0.0, 0.0]; count]);
    let world = studio.app.world_mut();
    let poses = SkinnedMeshInverseBindposes::from(vec![Mat4::IDENTITY]);
    let inverse_bindposes = world.resource_mut::<Assets<SkinnedMeshInverseBindposes>>().add(poses);
    let bone = world.spawn((Transform::default(), Visibility::default())).id();
    let skin = SkinnedMesh { inverse_bindposes, joints: vec![bone] };
    studio.add(small, Color::WHITE, (SurfaceStyle::Toon(style), skin));
    let mut edges = Vec::new();
    for shift in [0.0, SHIFT] {
        studio.app.world_mut().entity_mut(bone).insert(Transform::from_xyz(shift, 0.0, 0.0));
        let picture = studio.shoot();
        let row = SIZE.y / 2;
        let ring: Vec<u32> = (0..SIZE.x).filter(|x| picture.outline_in_row(row, *x..*x + 1) == 1).collect();
        println!("shifted by {shift} m: outline at {ring:?}");
        assert_eq!(ring.len(), 6);
        edges.push(ring);
    }
    let moved = (SHIFT / EXTENT * 0.5 * SIZE.y as f32) as u32;
    assert!(edges[0].iter().zip(&edges[1]).all(|(before, after)| after - before == moved));
}

#[test]
fn a_dome_shadow_drops_the_band() {
    const SKY: f32 = 0.4;
    const WALL: f32 = 0.3;
    const FOCAL: f32 = 80.0;
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    let world = studio.app.world_mut();
    world.despawn(studio.ball);
    world.despawn(studio.camera);
    let intrinsics = Intrinsics { focal: Vec2::splat(FOCAL), center: 0.5 * SIZE.as_vec2(), size: SIZE };
    let gray =
        FramePixels::new(SIZE, vec![128; 4 * (SIZE.x * SIZE.y) as usize]).expect("as many bytes as the size says");
    let above = Transform::from_xyz(0.0, 1.0, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z);
    let target = RenderTarget::Image(studio.picture.clone().into());
    world.spawn((ArCamera::new(intrinsics), CameraFeed::pixels(gray), above, target, Msaa::Off));
    let sky = UniformSky { radiance: Some(Vec3::splat(SKY)) };
    world.spawn((LightProbeSphere { radius: 0.1, ..default() }, sky, Transform::from_xyz(0.3, 0.05, 0.3)));
    world.spawn(ShadowDomeLight::default());
    studio.add(Plane3d::default().mesh().size(2.0, 2.0).build(), Color::WHITE, toon(3));
    let wall = Cuboid::new(0.02, WALL, 4.0).mesh().build();
    let wall = wall.translated_by(Vec3::new(-0.31, 0.5 * WALL, 0.0));
    let wall = studio.add(wall, Color::WHITE, SurfaceStyle::Engine);
    let shadowed = studio.shoot();
    studio.app.world_mut().despawn(wall);
    let open = studio.shoot();
    let mut seen = Vec::new();
    for away in [0.03, 0.06, 0.1, 0.15, 0.25, 0.4, 0.7] {
        // A long wall hides half of (1 − sin of the angle between its upper edge and the zenith) of a uniform sky.
        let share = 0.5 * (1.0 + f32::sin(f32::atan(away / WALL)));
        // Of an even sky, 70 % counts as dark and shows as 45 %.
        let expected = band_level((share - 0.7) / 0.3, 3).map(|level| SKY * (0.45 + 0.55 * level));
        let column = (0.5 * SIZE.x as f32 + FOCAL * (away - 0.3)) as u32;
        let pixel = UVec2::new(column, SIZE.y / 2);
        let (with, without) = (shadowed.linear(pixel).x, open.linear(pixel).x);
        println!("{away} m from the wall: {with:.3}, expected {expected:.3?}, without the wall {without:.3}");
        assert!((without - SKY).abs() < COLOR_TOLERANCE);
        if let Some(expected) = expected {
            assert!((with - expected).abs() < COLOR_TOLERANCE);
            seen.push((with * 1000.0) as u32);
        }
    }
    seen.dedup();
    assert_eq!(seen.len(), 3, "three bands");
}
