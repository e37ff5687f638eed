//! A small equirectangular picture of the measured environment, for the panel.

use crate::{environment::CubePixels, probe::EnvironmentCube};
use bevy::{
    asset::RenderAssetUsages,
    ecs::observer::On,
    prelude::*,
    render::{
        gpu_readback::{Readback, ReadbackComplete},
        render_resource::{Extent3d, TextureDimension, TextureFormat},
    },
};
use std::time::Duration;

/// Width of the picture in pixels; it is half as high.
pub(super) const SKY_WIDTH: u32 = 192;
/// The cube comes back from the GPU this often.
const REFRESH: Duration = Duration::from_millis(500);

/// The picture: azimuth from −Z towards +X to the right, +Y at the top.
#[derive(Resource)]
pub(super) struct SkyView {
    pub image: Handle<Image>,
    last: Option<Duration>,
}

impl FromWorld for SkyView {
    fn from_world(world: &mut World) -> Self {
        let extent = Extent3d { width: SKY_WIDTH, height: SKY_WIDTH / 2, depth_or_array_layers: 1 };
        let black = [0, 0, 0, 255];
        let format = TextureFormat::Rgba8UnormSrgb;
        let image = Image::new_fill(extent, TextureDimension::D2, &black, format, RenderAssetUsages::all());
        Self { image: world.resource_mut::<Assets<Image>>().add(image), last: None }
    }
}

pub(super) fn request_cube(
    mut commands: Commands,
    mut view: ResMut<SkyView>,
    cubes: Query<&EnvironmentCube>,
    time: Res<Time<Real>>,
) {
    let is_fresh = view.last.is_some_and(|last| time.elapsed() < last + REFRESH);
    let Some(cube) = cubes.iter().next().filter(|_| !is_fresh) else {
        return;
    };
    view.last = Some(time.elapsed());
    commands.spawn(Readback::texture(cube.0.clone())).observe(show_cube);
}

fn show_cube(
    answer: On<ReadbackComplete>,
    mut commands: Commands,
    view: Res<SkyView>,
    mut images: ResMut<Assets<Image>>,
) {
    commands.entity(answer.entity).despawn();
    let (Some(cube), Some(mut image)) =
        (CubePixels::from_rgba16f(EnvironmentCube::SIZE, &answer.data), images.get_mut(&view.image))
    else {
        return;
    };
    let pixels = cube
        .to_equirect(SKY_WIDTH, Quat::IDENTITY)
        .texels
        .into_iter()
        .flat_map(|radiance| Srgba::from(LinearRgba::from_vec3(radiance.min(Vec3::ONE))).to_u8_array());
    image.data = Some(pixels.collect());
}
