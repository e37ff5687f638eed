//! The dome on its way to the GPU.

use super::{FittedDome, dome, textures::DomeTextures};
use crate::probe::EnvironmentCube;
use bevy::{
    prelude::*,
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderSystems,
        extract_resource::ExtractResourcePlugin,
        render_asset::RenderAssets,
        render_resource::{ShaderType, encase::StorageBuffer},
        renderer::RenderQueue,
        storage::GpuShaderBuffer,
    },
};

pub(super) fn build(app: &mut App) {
    if app.get_sub_app(RenderApp).is_none() {
        warn!("ShadowsPlugin: no renderer, there will be no dome shadows");
        return;
    }
    app.add_plugins(ExtractResourcePlugin::<DomeTextures>::default());
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app
        .init_resource::<ExtractedDome>()
        .add_systems(ExtractSchedule, extract_dome)
        .add_systems(Render, write_views.in_set(RenderSystems::PrepareResources));
}

/// The dome as it is this frame.
#[derive(Resource, Default)]
pub(super) struct ExtractedDome {
    pub fitted: FittedDome,
    pub cube: Option<AssetId<Image>>,
}

fn extract_dome(
    mut extracted: ResMut<ExtractedDome>,
    fitted: Extract<Res<FittedDome>>,
    cubes: Extract<Query<&EnvironmentCube>>,
) {
    if fitted.is_changed() {
        extracted.fitted.clone_from(&fitted);
    }
    extracted.cube = cubes.iter().next().map(|cube| cube.0.id());
}

/// Mirror of `DomeView` in dome.wgsl.
#[derive(ShaderType, Clone, Copy)]
struct ViewUniform {
    right: Vec4,
    up: Vec4,
    depth: Vec4,
    direction: Vec4,
}

/// Mirror of `Dome` in dome.wgsl.
#[derive(ShaderType)]
struct DomeUniform {
    counts: UVec4,
    params: Vec4,
    #[shader(size(runtime))]
    views: Vec<ViewUniform>,
}

/// Share of a tile's width kept free around the casters, so that filters do not read the neighbor's casters.
const GUTTER: f32 = 2.0 / 32.0;

impl DomeUniform {
    fn new(fitted: &FittedDome, textures: &DomeTextures) -> Self {
        let layout = &textures.layout;
        // Without casters (or before the atlas has followed the settings) nothing is shadowed.
        let sphere = fitted.sphere.filter(|_| layout.directions == fitted.directions);
        let Some(sphere) = sphere else {
            return Self { counts: UVec4::new(0, 0, 1, 1), params: Vec4::ZERO, views: vec![ViewUniform::zero()] };
        };
        let half_width = sphere.radius * (1.0 + GUTTER);
        let views: Vec<ViewUniform> = dome::all_directions(fitted.directions)
            .into_iter()
            .map(|dir| ViewUniform::new(fitted.world_from_dome * dir, sphere, half_width))
            .collect();
        Self {
            counts: UVec4::new(fitted.directions, views.len() as u32, layout.columns, layout.rows),
            params: Vec4::new(2.0 * half_width / layout.resolution as f32, 0.0, 0.0, 0.0),
            views,
        }
    }
}

impl ViewUniform {
    fn zero() -> Self {
        Self { right: Vec4::ZERO, up: Vec4::ZERO, depth: Vec4::ZERO, direction: Vec4::ZERO }
    }

    fn new(direction: Vec3, sphere: dome::BoundingSphere, half_width: f32) -> Self {
        let (right, up) = direction.any_orthonormal_pair();
        let row = |axis: Vec3, scale: f32, offset: f32| (axis * scale).extend(offset - axis.dot(sphere.center) * scale);
        Self {
            right: row(right, 1.0 / half_width, 0.0),
            up: row(up, 1.0 / half_width, 0.0),
            depth: row(direction, 0.5 / half_width, 0.5),
            direction: direction.extend(0.0),
        }
    }
}

fn write_views(
    dome: Res<ExtractedDome>,
    textures: Option<Res<DomeTextures>>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    queue: Res<RenderQueue>,
    mut written: Local<Option<(FittedDome, DomeTextures)>>,
) {
    let Some(textures) = textures else {
        return;
    };
    let Some(buffer) = buffers.get(&textures.views) else {
        return;
    };
    let is_current =
        written.as_ref().is_some_and(|(fitted, last)| *fitted == dome.fitted && last.layout == textures.layout);
    if is_current {
        return;
    }
    let mut bytes = StorageBuffer::new(Vec::<u8>::new());
    if let Err(error) = bytes.write(&DomeUniform::new(&dome.fitted, &textures)) {
        error_once!("cannot lay out the dome's views: {error}");
        return;
    }
    queue.write_buffer(&buffer.buffer, 0, bytes.as_ref());
    *written = Some((dome.fitted.clone(), textures.clone()));
}
