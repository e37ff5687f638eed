//! Buffer of what is around all mirrors, which materials read.

use super::{
    NeighborReflections,
    mirror_bounds::MirrorBounds,
    neighbor_probe::{FILTER_FRAMES, NeighborProbe},
};
use crate::prefilter::{EnvironmentState, FilteredEnvironment, SceneCube};
use bevy::{
    asset::RenderAssetUsages,
    camera::primitives::Aabb,
    prelude::*,
    render::{
        Extract,
        render_resource::{ShaderType, encase::StorageBuffer},
        storage::ShaderBuffer,
    },
};

/// Maximum number of mirrors. Mirror of `NeighborCubes` in `neighbor_cubes.wgsl`.
pub(super) const MAX_MIRRORS: usize = 8;
/// Bytes before the texels, and of a texel.
const HEADER_BYTES: usize = 16 + 32 * MAX_MIRRORS;
const TEXEL_BYTES: usize = 8;
/// Texels that the header would take.
pub(super) const HEADER_TEXELS: u32 = (HEADER_BYTES / TEXEL_BYTES) as u32;

/// Mirror of `MirrorEntry` in `neighbor_cubes.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct MirrorEntry {
    pub(super) center: Vec3,
    pub(super) first_texel: u32,
    pub(super) half_extents: Vec3,
    pub(super) edge: u32,
}

/// Mirror of the start of `NeighborCubes` in `neighbor_cubes.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
struct CubesHeader {
    count: u32,
    mirrors: [MirrorEntry; MAX_MIRRORS],
}

/// Bytes at the start of the buffer.
pub(super) fn header_bytes(entries: &[MirrorEntry]) -> Vec<u8> {
    let mut header = CubesHeader { count: entries.len().min(MAX_MIRRORS) as u32, ..default() };
    header.mirrors.iter_mut().zip(entries).for_each(|(slot, entry)| *slot = *entry);
    let mut bytes = StorageBuffer::new(Vec::new());
    match bytes.write(&header) {
        Ok(()) => bytes.into_inner(),
        Err(_) => Vec::new(),
    }
}

/// Levels of a cube, of which the last has faces of four texels. Twin of `last_level` in `cube_layout.wgsl`.
pub(super) fn level_count(edge: u32) -> u32 {
    edge.ilog2() - 1
}

/// Index of the first texel of a level. Twin of `level_start` in `cube_layout.wgsl`.
fn level_start(edge: u32, level: u32) -> u32 {
    (0..level).map(|level| 6 * ((edge >> level) + 2).pow(2)).sum()
}

/// Edge length of all cubes.
pub(super) fn cube_edge(settings: &NeighborReflections) -> u32 {
    settings.edge.clamp(16, 256).next_power_of_two()
}

/// Buffer with a place for each mirror. The handle changes with the number of mirrors and the edge length.
#[derive(Resource)]
pub(in crate::materials) struct NeighborCubes {
    pub(in crate::materials) buffer: Handle<ShaderBuffer>,
    /// Edge length and number of the cubes for which there is place.
    fits: (u32, usize),
}

impl NeighborCubes {
    /// Whether there is place for any mirror.
    pub(in crate::materials) fn has_mirrors(&self) -> bool {
        self.fits.1 > 0
    }
}

impl FromWorld for NeighborCubes {
    fn from_world(world: &mut World) -> Self {
        Self { buffer: world.resource_mut::<Assets<ShaderBuffer>>().add(buffer_for(0, 0)), fits: (0, 0) }
    }
}

/// Empty buffer for a number of cubes.
fn buffer_for(edge: u32, cubes: usize) -> ShaderBuffer {
    // The shader's struct has at least two: its size is a multiple of 16 bytes.
    let texels = if cubes == 0 { 2 } else { cubes * level_start(edge, level_count(edge)) as usize };
    ShaderBuffer::new(&vec![0; HEADER_BYTES + TEXEL_BYTES * texels], RenderAssetUsages::RENDER_WORLD)
}

/// Makes room for the cubes of all probes, and notes which of them have new maps.
pub(super) fn fit_cubes(
    settings: Res<NeighborReflections>,
    mut cubes: ResMut<NeighborCubes>,
    mut buffers: ResMut<Assets<ShaderBuffer>>,
    mut probes: Query<(&mut NeighborProbe, &EnvironmentState)>,
) {
    let edge = cube_edge(&settings);
    let slots = probes.iter().map(|(probe, _)| probe.slot as usize + 1).max().unwrap_or_default();
    let is_new = slots > 0 && (cubes.fits.0 != edge || cubes.fits.1 < slots);
    if is_new {
        *cubes = NeighborCubes { buffer: buffers.add(buffer_for(edge, slots)), fits: (edge, slots) };
    }
    for (mut probe, state) in &mut probes {
        let EnvironmentState::Live { refreshes, .. } = state else { continue };
        let is_complete = probe.frames_since_first_round.is_some_and(|frames| frames >= FILTER_FRAMES);
        if is_complete && (is_new || probe.packed != Some(*refreshes)) {
            probe.packed = Some(*refreshes);
            probe.packs += 1;
        }
    }
}

/// Cube of a mirror as the render world needs it.
pub(super) struct ExtractedMirror {
    pub(super) probe: Entity,
    pub(super) entry: MirrorEntry,
    /// Number of times that the maps were to be packed.
    pub(super) packs: u32,
    pub(super) specular: AssetId<Image>,
    pub(super) scene: AssetId<Image>,
}

/// Cubes of all mirrors, in the order of their slots, and the buffer.
#[derive(Resource, Default)]
pub(super) struct ExtractedMirrors {
    pub(super) buffer: AssetId<ShaderBuffer>,
    pub(super) mirrors: Vec<ExtractedMirror>,
}

type Probe = (Entity, &'static NeighborProbe, &'static FilteredEnvironment, &'static SceneCube);

pub(super) fn extract_mirrors(
    mut extracted: ResMut<ExtractedMirrors>,
    cubes: Extract<Option<Res<NeighborCubes>>>,
    probes: Extract<Query<Probe>>,
    meshes: Extract<Query<(&Aabb, &GlobalTransform)>>,
) {
    extracted.mirrors.clear();
    let Some(cubes) = cubes.as_ref() else { return };
    extracted.buffer = cubes.buffer.id();
    let edge = cubes.fits.0;
    for (entity, probe, maps, cube) in probes.iter().filter(|(_, probe, ..)| probe.packs > 0) {
        let Ok((aabb, place)) = meshes.get(probe.mirror) else { continue };
        let MirrorBounds { center, half_extents } = MirrorBounds::new(aabb, &place.affine());
        let first_texel = probe.slot * level_start(edge, level_count(edge));
        extracted.mirrors.push(ExtractedMirror {
            probe: entity,
            entry: MirrorEntry { center, first_texel, half_extents, edge },
            packs: probe.packs,
            specular: maps.specular.id(),
            scene: cube.cube.id(),
        });
    }
    extracted.mirrors.sort_by_key(|mirror| mirror.entry.first_texel);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_is_as_long_as_the_shader_says() {
        let entry = MirrorEntry { center: Vec3::ONE, first_texel: 7, half_extents: Vec3::splat(0.5), edge: 128 };
        let bytes = header_bytes(&[entry; 2]);
        assert_eq!(bytes.len(), HEADER_BYTES);
        assert_eq!(bytes[..4], 2_u32.to_le_bytes());
        assert_eq!(bytes[16 + 32 + 12..][..4], 7_u32.to_le_bytes());
        assert_eq!(header_bytes(&[]).len(), HEADER_BYTES);
    }

    #[test]
    fn levels_end_with_four_texels() {
        assert_eq!(level_count(128), 6);
        assert_eq!(128 >> (level_count(128) - 1), 4);
        assert_eq!(level_start(16, 2), 6 * (18 * 18 + 10 * 10));
    }
}
