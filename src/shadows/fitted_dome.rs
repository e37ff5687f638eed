//! The dome as it is fitted to settings, casters and lights, and the choice of shadow maps to redraw.

use super::{
    bounding_sphere::BoundingSphere,
    casters::{self, Caster},
    directions::Directions,
    dome_light::VisibilitySamples,
    filter::ShadowFilter,
    key_lights::KeyLight,
    refresh::RefreshSchedule,
    view::LightView,
};
use bevy::prelude::*;
use std::sync::Arc;

/// Everything that the render world needs to know about the dome.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub(super) struct FittedDome {
    /// Empty without a dome.
    pub(super) directions: Directions,
    /// Views of the directions with shadow maps, from a file. Empty if all their light is parallel.
    pub(super) file_views: Arc<[LightView]>,
    /// Slots for key lights; some may be free.
    pub(super) keys: Vec<Option<KeyLight>>,
    pub(super) world_from_dome: Quat,
    pub(super) filter: ShadowFilter,
    pub(super) samples: VisibilitySamples,
    pub(super) dim_share: f32,
    pub(super) occludes_reflections: bool,
    /// Whether the scene has lamps of the engine, which shine on phantoms.
    pub(super) has_lamps: bool,
    pub(super) sphere: Option<BoundingSphere>,
    pub(super) casters: Vec<Caster>,
}

impl FittedDome {
    /// Returns the number of directions with shadow maps, without key lights.
    pub(super) fn direction_count(&self) -> u32 {
        self.directions.shadowed.len() as u32
    }

    /// Returns the number of shadow maps: those of directions, then those of key lights.
    pub(super) fn shadow_maps(&self) -> u32 {
        self.direction_count() + self.keys.len() as u32
    }

    /// Returns the view of a direction with a shadow map, or of a key light. `None` for a free slot.
    pub(super) fn view(&self, index: u32) -> Option<LightView> {
        let index = index as usize;
        match index.checked_sub(self.directions.shadowed.len()) {
            Some(key) => self.keys.get(key).copied().flatten().map(|key| key.view),
            None => self.file_views.get(index).copied().or_else(|| {
                let direction = self.directions.shadowed.get(index)?;
                Some(LightView::parallel(self.world_from_dome * *direction, 0.0))
            }),
        }
    }

    /// Returns whether the dome has changed so much that all shadow maps must be redrawn.
    fn differs_from(&self, old: &Self) -> bool {
        self.directions != old.directions
            || self.file_views != old.file_views
            || self.keys.len() != old.keys.len()
            || self.world_from_dome != old.world_from_dome
            || self.filter != old.filter
    }
}

/// Ages of the shadow maps, and the ones to redraw.
#[derive(Resource, Default)]
pub(super) struct Refreshing {
    pub(super) schedule: RefreshSchedule,
    /// Directions to redraw in this frame.
    pub(super) chosen: Vec<u32>,
    /// Luminance × solid angle of each direction, read back from the GPU.
    pub(super) energies: Vec<f32>,
    pub(super) readback: Option<Entity>,
}

impl Refreshing {
    /// Advances the ages of the shadow maps by one frame, in which the dome, its key lights and casters may have
    /// changed.
    pub(super) fn follow(&mut self, old: &FittedDome, new: &FittedDome) {
        let direction = |index: u32| new.view(index).map(|view| view.direction);
        let (first_key, all) = (new.direction_count(), new.shadow_maps());
        if new.differs_from(old) {
            self.schedule = RefreshSchedule::new((0..all).map(direction));
            return;
        }
        self.schedule.advance(casters::movement(&old.casters, &new.casters));
        for index in (first_key..all).filter(|index| new.view(*index) != old.view(*index)) {
            self.schedule.replace(index as usize, direction(index));
        }
    }
}
