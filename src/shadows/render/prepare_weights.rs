//! Cells of the directions on the GPU, and the bindings of the weights pass.

use super::{
    extract::{DomeSource, ExtractedDome},
    gpu::{Gpu, GpuAssets},
    weights_pipeline::{WeightsPipelines, WeightsUniform},
};
use crate::{
    environment_map::cube_faces,
    shadows::{
        atlas::DomeTextures,
        directions::{Cells, Directions},
        fitted_dome::FittedDome,
        key_lights::KeyLight,
    },
};
use bevy::{
    prelude::*,
    render::{
        render_resource::{BindGroup, BindGroupEntries, StorageBuffer, TextureUsages, TextureViewId, UniformBuffer},
        texture::GpuImage,
    },
};
use std::{
    f32::consts::{FRAC_PI_2, PI},
    ops::RangeInclusive,
};

/// Radius of a key light's cone in angular radii of the light. The light within the cone belongs to the key light.
const CONE_RADII: f32 = 1.25;
/// Patches by which the cone is wider, because the cube spreads the light over them.
const CONE_MARGIN_PATCHES: f32 = 1.5;
/// A cone that holds no direction.
const NO_CONE: Vec4 = Vec4::new(0.0, 0.0, 0.0, 2.0);
/// Range of the edges of the cubes by which the sphere is divided. Within it, an edge is half that of the
/// environment, so that a bilinear lookup averages four texels and skips none.
const CELL_EDGES: RangeInclusive<u32> = 16..=128;

/// Cells of the current directions, and bindings that are remade only when their sources change.
#[derive(Resource, Default)]
pub(super) struct PreparedWeights {
    cells: Option<CellBuffers>,
    pub(super) bind_group: Option<BindGroup>,
    pub(super) made_from: Option<WeightsSources>,
    /// Number of writes of the cube at the time when its light was last summed.
    pub(super) summed_writes: Option<u32>,
    /// Number of times that light was summed.
    pub(super) sums: u32,
}

/// Everything on which the weights depend, besides the contents of the cube.
#[derive(Clone, PartialEq)]
pub(super) struct WeightsSources {
    view: TextureViewId,
    pub(super) cube: AssetId<Image>,
    cube_from_dome: Quat,
    /// Whether passes that do not announce it may write the cube on the GPU.
    pub(super) is_restless: bool,
    cells: CellKey,
    cones: Vec<Vec4>,
    dim_share: f32,
}

impl WeightsSources {
    /// Number of directions and key lights, each of which is one workgroup.
    pub(super) fn light_count(&self) -> u32 {
        (self.cells.directions.all().count() + self.cones.len()) as u32
    }
}

/// Directions, and the edge of the cube by which the sphere is divided among them.
#[derive(Clone, PartialEq)]
struct CellKey {
    directions: Directions,
    edge: u32,
}

struct CellBuffers {
    made_for: CellKey,
    patches: StorageBuffer<Vec<Vec4>>,
    ranges: StorageBuffer<Vec<UVec4>>,
}

impl CellBuffers {
    fn new(made_for: CellKey, gpu: &Gpu) -> Self {
        let cells = Cells::new(&made_for.directions, made_for.edge);
        let patches = gpu.storage_buffer("mirrorball_shadows_patches", cells.patches, Vec4::ZERO);
        let ranges = gpu.storage_buffer("mirrorball_shadows_ranges", cells.ranges, UVec4::ZERO);
        Self { made_for, patches, ranges }
    }
}

pub(super) fn prepare_weights(
    mut prepared: ResMut<PreparedWeights>,
    dome: Res<ExtractedDome>,
    textures: Option<Res<DomeTextures>>,
    pipelines: Res<WeightsPipelines>,
    assets: GpuAssets,
    gpu: Gpu,
) {
    let FittedDome { directions, dim_share, .. } = &dome.fitted;
    let Some((source, cube)) = source_cube(&dome, &assets) else {
        *prepared = PreparedWeights { cells: prepared.cells.take(), sums: prepared.sums, ..default() };
        return;
    };
    let size = cube.texture_descriptor.size.width;
    let edge = (size / 2).clamp(*CELL_EDGES.start(), *CELL_EDGES.end());
    let key = CellKey { directions: directions.clone(), edge };
    if prepared.cells.as_ref().is_none_or(|cells| cells.made_for != key) {
        prepared.cells = Some(CellBuffers::new(key.clone(), &gpu));
    }
    let made_from = WeightsSources {
        view: cube.texture_view.id(),
        cube: source.cube,
        cube_from_dome: source.cube_from_world * dome.fitted.world_from_dome,
        is_restless: cube.texture_descriptor.usage.contains(TextureUsages::STORAGE_BINDING) && !source.is_measured,
        cells: key,
        cones: key_cones(&dome.fitted, edge),
        dim_share: *dim_share,
    };
    if prepared.bind_group.is_some() && prepared.made_from.as_ref() == Some(&made_from) {
        return;
    }
    let bind_group = textures.and_then(|textures| {
        bind_weights(&made_from, cube, prepared.cells.as_ref()?, &textures, &pipelines, &assets, &gpu)
    });
    (prepared.bind_group, prepared.made_from, prepared.summed_writes) = (bind_group, Some(made_from), None);
}

/// Returns the cube that lights the dome, if there is a dome and the cube is on the GPU.
fn source_cube<'a>(dome: &ExtractedDome, assets: &'a GpuAssets) -> Option<(DomeSource, &'a GpuImage)> {
    let source = dome.source.filter(|_| !dome.fitted.directions.shadowed.is_empty())?;
    let image = assets.images.get(source.cube)?;
    (image.texture_descriptor.size.depth_or_array_layers == 6).then_some((source, image))
}

/// Returns the cones of light that belong to key lights: direction in the dome's frame, and cosine of the radius.
fn key_cones(fitted: &FittedDome, edge: u32) -> Vec<Vec4> {
    let cone = |key: &KeyLight| {
        let radius = CONE_RADII * key.angular_radius + CONE_MARGIN_PATCHES * FRAC_PI_2 / edge as f32;
        (fitted.world_from_dome.inverse() * key.direction_in_map).extend(radius.min(PI).cos())
    };
    fitted.keys.iter().map(|key| key.as_ref().map_or(NO_CONE, cone)).collect()
}

/// Writes the uniform and the cones, and binds them with the cube, the cells and the weights.
fn bind_weights(
    sources: &WeightsSources,
    cube: &GpuImage,
    cells: &CellBuffers,
    textures: &DomeTextures,
    pipelines: &WeightsPipelines,
    assets: &GpuAssets,
    gpu: &Gpu,
) -> Option<BindGroup> {
    let results = assets.buffers.get(&textures.results)?;
    let CellKey { directions, edge } = &sources.cells;
    let level = (cube.texture_descriptor.size.width / (2 * edge)).max(1).ilog2();
    let mut uniform = UniformBuffer::from(WeightsUniform {
        cube_from_dome: Mat3::from_quat(sources.cube_from_dome),
        counts: UVec3::new(directions.shadowed.len() as u32, sources.cones.len() as u32, directions.below.len() as u32),
        dim_share: sources.dim_share,
        level: level.min(cube.texture_descriptor.mip_level_count - 1),
    });
    uniform.set_label(Some("mirrorball_shadows_weights_uniform"));
    uniform.write_buffer(&gpu.device, &gpu.queue);
    let cones = gpu.storage_buffer("mirrorball_shadows_keys", sources.cones.clone(), NO_CONE);
    let faces = cube_faces(&cube.texture);
    let entries = BindGroupEntries::sequential((
        &faces,
        uniform.binding()?,
        cells.patches.binding()?,
        cells.ranges.binding()?,
        results.buffer.as_entire_binding(),
        cones.binding()?,
    ));
    Some(gpu.bind_group("mirrorball_shadows_weights_bind_group", &pipelines.layout, &entries))
}
