//! Map views: live images of the environment maps.
//!
//! **Enters:** [`MapView`]s, the measured cube and the filtered maps. **Leaves:** an equirectangular image for each
//! view. Costs one compute dispatch of 192 × 96 pixels per view and frame.

mod extract;
mod map_view_pass;
mod map_view_pipeline;

use crate::{
    device::{self, Needs},
    environment_map,
};
use bevy::{
    asset::{RenderAssetUsages, embedded_asset},
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        ExtractSchedule, RenderApp, RenderStartup,
        render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages},
        renderer::{RenderGraph, RenderGraphSystems},
    },
};
use extract::{ExtractedViews, extract_views};
use map_view_pass::map_view_pass;
use map_view_pipeline::init_map_view_pipeline;

/// Map to show: one of those that light the scene.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ShownMap {
    /// Environment as the probes measured it, in linear camera units.
    #[default]
    Measured,
    /// Confidence of each direction of the measured environment, 0…1 as gray.
    Confidence,
    /// Diffuse map: irradiance ÷ π for each surface normal.
    Diffuse,
    /// Specular map at a level: radiance for each mirror direction. Of n levels, level m has perceptual roughness
    /// m / (n − 1). Levels beyond the last show the last.
    Specular(u32),
}

impl ShownMap {
    /// Old name of [`ShownMap::Specular`].
    #[deprecated(since = "0.1.0", note = "use `ShownMap::Specular`")]
    #[doc(hidden)]
    #[expect(non_snake_case, reason = "the name that the variant had")]
    pub fn Glossy(level: u32) -> Self {
        Self::Specular(level)
    }
}

/// Live equirectangular image of one map, for panels and user interfaces.
///
/// Columns are the azimuth from −Z towards +X, rows run from +Y down. Colors are linear and clipped at 1.0. The map
/// is that of the first [`ArCamera`](crate::camera::ArCamera) or, without one, of the first lit camera or probe.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::debug::{MapView, ShownMap};
/// # fn setup(
/// #     mut commands: Commands,
/// #     mut images: ResMut<Assets<Image>>,
/// #     mut materials: ResMut<Assets<StandardMaterial>>,
/// #     screen: Entity,
/// # ) {
/// let view = MapView::new(ShownMap::Specular(0), &mut images);
/// let surface = StandardMaterial { base_color_texture: Some(view.image.clone()), unlit: true, ..default() };
/// commands.entity(screen).insert((MeshMaterial3d(materials.add(surface)), view));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Default, Debug, Clone)]
pub struct MapView {
    /// Map to show. Defaults to the measured environment.
    pub map: ShownMap,
    /// Image of the map. The GPU writes it: do not change the asset. Defaults to one that is allocated when the view is
    /// spawned.
    pub image: Handle<Image>,
}

impl MapView {
    /// Width and height of the image, in pixels.
    pub const SIZE: UVec2 = UVec2::new(192, 96);

    /// Creates a view of a map. The image is black until the map exists.
    pub fn new(map: ShownMap, images: &mut Assets<Image>) -> Self {
        let extent = Extent3d { width: Self::SIZE.x, height: Self::SIZE.y, depth_or_array_layers: 1 };
        let format = TextureFormat::Rgba16Float;
        let mut image = Image::new_uninit(extent, TextureDimension::D2, format, RenderAssetUsages::RENDER_WORLD);
        image.texture_descriptor.label = Some("mirrorball_debug_map_view");
        image.texture_descriptor.usage =
            TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC;
        Self { map, image: images.add(image) }
    }
}

impl Default for MapView {
    /// A view of the measured environment. The plugin allocates its image when it is spawned.
    fn default() -> Self {
        Self { map: ShownMap::default(), image: Handle::default() }
    }
}

// A handle takes its component out of Bevy's blanket `FromTemplate`, which `bsn!` needs. No file is drawn into, so a
// template that loads one would be of no use.
impl Unpin for MapView {}

/// Gives views without an image one.
fn allocate_images(mut views: Query<&mut MapView, Added<MapView>>, mut images: ResMut<Assets<Image>>) {
    for mut view in &mut views {
        if view.image == Handle::default() {
            *view = MapView::new(view.map, &mut images);
        }
    }
}

/// Draws [`MapView`]s. Costs nothing without them.
pub struct MapViewPlugin;

impl Plugin for MapViewPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(PreUpdate, allocate_images.run_if(resource_exists::<Assets<Image>>));
    }

    fn finish(&self, app: &mut App) {
        let needs = Needs {
            plugin: "MapViewPlugin",
            purpose: "environments will not be shown as pictures",
            storage_buffers: 0,
            storage_textures: 1,
        };
        if !device::can_draw(app, &needs) {
            return;
        }
        environment_map::load_shaders(app);
        embedded_asset!(app, "map_view_pass.wgsl");
        app.sub_app_mut(RenderApp)
            .init_resource::<ExtractedViews>()
            .add_systems(RenderStartup, init_map_view_pipeline)
            .add_systems(ExtractSchedule, extract_views)
            .add_systems(RenderGraph, map_view_pass.in_set(RenderGraphSystems::Render).after(camera_driver));
    }
}
