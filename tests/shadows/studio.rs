//! A ball in front of a camera without tone mapping, and the images of it.

use crate::{
    drawing,
    radiance_cube::{cube_image, texels},
};
use bevy::{
    asset::RenderAssetUsages,
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    image::ImageSampler,
    mesh::{
        VertexAttributeValues,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_mirrorball::{camera::srgb_to_linear, headless, prelude::*};

/// Rounding to 8 bits, half floats of the filtered sky and its 16² texels.
pub(crate) const COLOR_TOLERANCE: f32 = 0.02;

pub(crate) const SIZE: UVec2 = UVec2::new(96, 96);
/// Half the camera's vertical extent in meters; the camera is orthographic, so pixels are normals of a ball.
pub(crate) const EXTENT: f32 = 0.6;
pub(crate) const RADIUS: f32 = 0.5;
pub(crate) const BACKGROUND: Color = Color::linear_rgb(0.0, 0.0, 0.5);

/// Texels across a face of the sky's cube.
const SKY_EDGE: usize = 32;

/// Shaders have arrived when this many frames of 1 ms bring none.
const QUIET_FRAMES: u32 = 50;

#[derive(Resource)]
struct KeptShaders(#[expect(dead_code, reason = "keeps the assets loaded")] [Handle<Shader>; 5]);

/// Loads all shaders beforehand: in a busy machine the first pictures would lack what is not there yet.
fn load_shaders(app: &mut App) {
    let assets = app.world().resource::<AssetServer>().clone();
    let shaders = ["classic/classic", "image_based", "outline/outline", "phantom", "toon/toon"]
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
pub(crate) struct Studio {
    pub(crate) app: App,
    pub(crate) picture: Handle<Image>,
    pub(crate) camera: Entity,
    pub(crate) ball: Entity,
}

pub(crate) fn ball_mesh() -> Mesh {
    Sphere::new(RADIUS).mesh().ico(24).expect("few enough")
}

/// A mesh that hangs on one bone wholly.
pub(crate) fn on_a_bone(mesh: Mesh) -> Mesh {
    let count = mesh.count_vertices();
    mesh.with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_INDEX, VertexAttributeValues::Uint16x4(vec![[0; 4]; count]))
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, vec![[1.0, 0.0, 0.0, 0.0]; count])
}

/// A checkerboard of two colors, in linear numbers.
pub(crate) fn checkers(a: [u8; 4], b: [u8; 4]) -> Image {
    const EDGE: u32 = 8;
    let texels = (0..EDGE * EDGE).flat_map(|i| if (i + i / EDGE).is_multiple_of(2) { a } else { b });
    let extent = Extent3d { width: EDGE, height: EDGE, depth_or_array_layers: 1 };
    let usage = RenderAssetUsages::default();
    let mut image = Image::new(extent, TextureDimension::D2, texels.collect(), TextureFormat::Rgba8Unorm, usage);
    image.sampler = ImageSampler::nearest();
    image
}

impl Studio {
    pub(crate) fn new(style: SurfaceStyle) -> Option<Self> {
        let mut app = drawing::app()?;
        load_shaders(&mut app);
        app.insert_resource(ClearColor(BACKGROUND));
        let (picture, target) = headless::add_target(&mut app, SIZE);
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

    pub(crate) fn add(
        &mut self,
        mesh: impl Into<Mesh>,
        material: impl Into<StandardMaterial>,
        extra: impl Bundle,
    ) -> Entity {
        let world = self.app.world_mut();
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
        let material = world.resource_mut::<Assets<StandardMaterial>>().add(material.into());
        world.spawn((Mesh3d(mesh), MeshMaterial3d(material), extra)).id()
    }

    /// A bone, and the skin of a mesh on it.
    pub(crate) fn add_bone(&mut self, place: Transform) -> (Entity, SkinnedMesh) {
        let world = self.app.world_mut();
        let poses = SkinnedMeshInverseBindposes::from(vec![Mat4::IDENTITY]);
        let inverse_bindposes = world.resource_mut::<Assets<SkinnedMeshInverseBindposes>>().add(poses);
        let bone = world.spawn((place, Visibility::default())).id();
        (bone, SkinnedMesh { inverse_bindposes, joints: vec![bone] })
    }

    /// A lamp at infinity that makes white paper facing it show `radiance` in the frame buffer.
    pub(crate) fn add_lamp(&mut self, dir: Vec3, radiance: f32) {
        let illuminance = radiance * std::f32::consts::PI / Exposure::default().exposure();
        let lamp = DirectionalLight { illuminance, ..default() };
        self.app.world_mut().spawn((lamp, Transform::default().looking_to(-dir, Vec3::Y)));
    }

    /// A sky in which white paper facing `n` shows a mixture of two colors, `bright` at `dir` and `dark` opposite.
    pub(crate) fn add_sky(&mut self, dir: Vec3, dark: Vec3, bright: Vec3) {
        // The cosine sum of a constant is itself, that of a cosine two thirds of it.
        let radiance = |d: Vec3| 0.5 * (dark + bright) + 0.75 * (bright - dark) * d.dot(dir);
        let sky = texels(SKY_EDGE, |dir| radiance(dir.as_vec3()).as_dvec3());
        let source = self.app.world_mut().resource_mut::<Assets<Image>>().add(cube_image(SKY_EDGE, &sky));
        self.app.world_mut().entity_mut(self.camera).insert(LiveEnvironment::new(source));
    }

    /// Replaces the ball.
    pub(crate) fn set_ball(&mut self, material: impl Into<StandardMaterial>, style: SurfaceStyle) {
        let ball = self.add(ball_mesh(), material, style);
        self.app.world_mut().despawn(std::mem::replace(&mut self.ball, ball));
    }

    pub(crate) fn set_style(&mut self, style: SurfaceStyle) {
        self.app.world_mut().entity_mut(self.ball).insert(style);
    }

    pub(crate) fn shoot(&mut self) -> Picture {
        // Materials, outlines and environments follow within three frames.
        for _ in 0..3 {
            self.app.update();
        }
        Picture(headless::read_texture(&mut self.app, &self.picture).expect("the picture comes back"))
    }

    pub(crate) fn count<C: Component>(&mut self) -> usize {
        let world = self.app.world_mut();
        world.query::<&C>().iter(world).count()
    }
}

#[derive(PartialEq)]
pub(crate) struct Picture(Vec<u8>);

impl Picture {
    pub(crate) fn linear(&self, pixel: UVec2) -> Vec3 {
        let at = 4 * (pixel.y * SIZE.x + pixel.x) as usize;
        Vec3::from_array([0, 1, 2].map(|c| srgb_to_linear(self.0[at + c])))
    }

    /// Largest difference over the whole picture.
    pub(crate) fn difference(&self, other: &Self) -> u8 {
        self.0.iter().zip(&other.0).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
    }

    /// Pixels of a row's left half that have the outline's color (green).
    pub(crate) fn outline_in_row(&self, row: u32, columns: std::ops::Range<u32>) -> usize {
        columns.filter(|x| self.linear(UVec2::new(*x, row)).y > 0.9).count()
    }
}

/// Pixels well inside the ball and the ball's normal there.
pub(crate) fn normals() -> impl Iterator<Item = (UVec2, Vec3)> {
    (0..SIZE.x * SIZE.y).filter_map(|i| {
        let pixel = UVec2::new(i % SIZE.x, i / SIZE.x);
        let across = (pixel.as_vec2() + 0.5) / (0.5 * SIZE.as_vec2()) - 1.0;
        let normal = Vec2::new(across.x, -across.y) * (EXTENT / RADIUS);
        let depth = 1.0 - normal.length_squared();
        (depth > 0.15).then(|| (pixel, normal.extend(depth.sqrt())))
    })
}

pub(crate) fn toon(bands: u32) -> SurfaceStyle {
    SurfaceStyle::Toon(ToonStyle { bands, highlight: false, outline_width: 0.0, ..default() })
}
