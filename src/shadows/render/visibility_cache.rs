//! Lookups of shadow maps that the visibility pass keeps from frame to frame, and what no longer holds of them.

use super::prepare_views::DomeViews;
use crate::shadows::{
    atlas::DomeTextures,
    dome_light::{ShadowDomeLight, VisibilitySamples},
    fitted_dome::FittedDome,
};
use bevy::{
    prelude::*,
    render::{
        render_resource::{
            Buffer, BufferDescriptor, BufferId, BufferUsages, ShaderType, TextureViewId, encase::UniformBuffer,
        },
        renderer::{RenderDevice, RenderQueue},
    },
};
use std::collections::BTreeSet;

/// Maximum numbers of directions with shadow maps, the same with key lights, and of words with a bit for each of these.
/// Twins of the constants in `visibility_cache.wgsl`.
const MAX_DIRECTIONS: u64 = ShadowDomeLight::MAX_DIRECTIONS as u64;
const MAX_SHADOW_MAPS: u64 = MAX_DIRECTIONS + ShadowDomeLight::MAX_KEY_LIGHTS as u64;
const CHANGE_WORDS: usize = 36;
/// Bytes of `Plan` in `visibility_cache.wgsl` before its tiles, for interleaved samples, which have the longest counts.
const PLAN_BYTES: u64 =
    (4 * (1 + 2 * 4 + 4 * MAX_SHADOW_MAPS)).next_multiple_of(16) + 16 * (MAX_SHADOW_MAPS + MAX_DIRECTIONS);
/// Offset in bytes of the number of workgroups that look up listed directions, and bytes of both numbers.
pub(super) const FRESH_GROUPS_OFFSET: u64 = 12;
const GROUPS_BYTES: u64 = 24;
/// Number of frames without a change of light after which it is at rest. Live cameras deliver every second or third
/// frame.
const RESTING_FRAMES: u32 = 4;
/// Largest size of the kept lookups in bytes, as every WebGPU device can bind it. Beyond, they are not kept.
const MAX_LOOKUP_BYTES: u64 = 128 << 20;

/// Mirror of `Changes` in `visibility_cache.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ChangesUniform {
    redrawn: [UVec4; CHANGE_WORDS / 4],
    keys: u32,
    redrawn_keys: u32,
    is_new: u32,
    sums_all: u32,
    is_at_rest: u32,
}

impl ChangesUniform {
    /// Whether there are key lights to look up in changed tiles.
    pub(super) fn has_keys(&self) -> bool {
        self.keys != 0
    }

    /// Whether there are directions to look up in tiles that show what they have shown.
    pub(super) fn has_fresh(&self) -> bool {
        self.is_new == 0 && self.sums_all != 0
    }

    pub(super) fn has_fresh_keys(&self) -> bool {
        self.is_new == 0 && self.redrawn_keys != 0
    }

    pub(super) fn sums_all(&self) -> bool {
        self.sums_all != 0
    }
}

/// Everything besides surfaces, shadow maps and light on which lookups depend.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct LookupSources {
    pub(super) prepass: [TextureViewId; 2],
    pub(super) atlas: AssetId<Image>,
    pub(super) samples: BufferId,
    pub(super) resolution: Option<UVec2>,
}

/// Sizes of the buffers: samples across and down, and lookups per sample, which reads every `step`th direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CacheSize {
    samples: UVec2,
    step: u32,
    slots: u32,
}

impl CacheSize {
    fn new(fitted: &FittedDome, samples: UVec2) -> Self {
        let step = if fitted.samples == VisibilitySamples::Interleaved { 4 } else { 1 };
        Self { samples, step, slots: fitted.shadow_maps().div_ceil(step) + fitted.keys.len() as u32 }
    }

    fn lookup_bytes(self) -> u64 {
        4 * u64::from(self.samples.x) * u64::from(self.samples.y) * u64::from(self.slots.div_ceil(2)).max(1)
    }

    fn plan_bytes(self) -> u64 {
        let tiles = (self.samples + 7) / 8;
        // The size of the structure is a multiple of 16 bytes.
        PLAN_BYTES + (4 * u64::from(tiles.x) * u64::from(tiles.y)).next_multiple_of(16)
    }
}

/// The buffers, and for what they were written last.
pub(super) struct VisibilityCache {
    size: CacheSize,
    pub(super) lookups: Buffer,
    pub(super) plan: Buffer,
    pub(super) changes: Buffer,
    pub(super) groups: Buffer,
    /// `None` before anything was written.
    sources: Option<LookupSources>,
    /// Number of sums of the environment's light at that time, and of times since it has changed.
    weights: u32,
    at_rest: u32,
}

impl VisibilityCache {
    /// Keeps a cache that fits a dome and a number of samples, or replaces it. `None` if it would be too large.
    pub(super) fn fit(
        last: Option<Self>,
        fitted: &FittedDome,
        textures: &DomeTextures,
        device: &RenderDevice,
    ) -> Option<Self> {
        let size = CacheSize::new(fitted, textures.visibility_size);
        let limit = MAX_LOOKUP_BYTES.min(device.limits().max_storage_buffer_binding_size);
        if size.lookup_bytes() > limit {
            return None;
        }
        if let Some(last) = last.filter(|last| last.size == size) {
            return Some(last);
        }
        let buffer = |label, size, usage| {
            device.create_buffer(&BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        Some(Self {
            size,
            lookups: buffer("mirrorball_shadows_lookups", size.lookup_bytes(), BufferUsages::STORAGE),
            plan: buffer("mirrorball_shadows_visibility_plan", size.plan_bytes(), BufferUsages::STORAGE),
            changes: buffer(
                "mirrorball_shadows_visibility_changes",
                ChangesUniform::min_size().get(),
                BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            ),
            groups: buffer(
                "mirrorball_shadows_visibility_groups",
                GROUPS_BYTES,
                BufferUsages::STORAGE | BufferUsages::INDIRECT,
            ),
            sources: None,
            weights: 0,
            at_rest: 0,
        })
    }

    /// Writes and returns what has changed since the last time. `weights` is the number of times that the environment's
    /// light was summed.
    pub(super) fn follow(
        &mut self,
        sources: LookupSources,
        weights: u32,
        fitted: &FittedDome,
        views: &mut DomeViews,
        queue: &RenderQueue,
    ) -> ChangesUniform {
        let Redrawn { all, indices, surfels } = std::mem::take(&mut views.redrawn);
        let is_new = all || self.sources.as_ref() != Some(&sources);
        let first_key = fitted.direction_count();
        let is_taken = |key: &u32| fitted.keys[*key as usize].is_some();
        let taken = (0..fitted.keys.len() as u32).filter(is_taken).map(|key| 1 << key).sum();
        self.at_rest = if self.weights == weights { self.at_rest.saturating_add(1) } else { 0 };
        let is_at_rest = self.at_rest == RESTING_FRAMES;
        let mut changes = ChangesUniform {
            keys: taken,
            is_new: is_new.into(),
            sums_all: (is_new || is_at_rest || self.at_rest == 0 || surfels || !indices.is_empty()).into(),
            is_at_rest: is_at_rest.into(),
            ..default()
        };
        for index in indices {
            changes.redrawn[index as usize / 128][index as usize / 32 % 4] |= 1 << (index % 32);
            if let Some(key) = index.checked_sub(first_key) {
                changes.redrawn_keys |= taken & (1 << key);
            }
        }
        let mut bytes = UniformBuffer::new(Vec::<u8>::new());
        if let Err(error) = bytes.write(&changes) {
            error_once!("cannot lay out the changes of the dome: {error}");
        }
        queue.write_buffer(&self.changes, 0, bytes.as_ref());
        (self.sources, self.weights) = (Some(sources), weights);
        changes
    }
}

/// What was drawn or lit since the visibility pass has last run.
#[derive(Debug, Default)]
pub(super) struct Redrawn {
    /// Whether the dome has changed so much that no lookup holds.
    pub(super) all: bool,
    /// Directions and key lights.
    pub(super) indices: BTreeSet<u32>,
    /// Whether surfels were lit.
    pub(super) surfels: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shadows::directions::Directions;

    #[test]
    fn every_direction_and_key_light_has_a_bit() {
        assert!(CHANGE_WORDS as u64 * 32 >= MAX_SHADOW_MAPS && CHANGE_WORDS.is_multiple_of(4));
    }

    #[test]
    fn interleaved_lookups_take_a_quarter_of_the_bytes() {
        let size = |samples| {
            let fitted =
                FittedDome { directions: Directions::spread(default(), 64), keys: vec![None; 2], samples, ..default() };
            CacheSize::new(&fitted, UVec2::new(320, 180)).lookup_bytes()
        };
        assert_eq!(size(VisibilitySamples::Interleaved), 320 * 180 * 2 * (17 + 2 + 1));
        assert_eq!(size(VisibilitySamples::Half), 320 * 180 * 2 * (66 + 2));
    }

    #[test]
    fn a_plan_is_never_read_with_the_layout_of_other_samples() {
        let size = |samples| CacheSize::new(&FittedDome { samples, ..default() }, UVec2::new(320, 180));
        assert_eq!(size(VisibilitySamples::Half).lookup_bytes(), size(VisibilitySamples::Interleaved).lookup_bytes());
        assert_ne!(size(VisibilitySamples::Half), size(VisibilitySamples::Interleaved));
    }
}
