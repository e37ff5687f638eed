//! Viewing camera: the one that the player looks through, and its exposure.

use crate::camera::ArCamera;
use bevy::{
    camera::Exposure,
    ecs::{query::QueryFilter, system::SystemParam},
    prelude::*,
};

/// Intensity in cd/m² at which 1.0 in a map becomes 1.0 in the frame buffer.
pub(super) fn unit_intensity(exposure: Option<&Exposure>) -> f32 {
    1.0 / exposure.copied().unwrap_or_default().exposure()
}

type View = (&'static Camera, Has<ArCamera>, Option<&'static Exposure>, Option<&'static AmbientLight>);

/// Camera that the player looks through: the active [`ArCamera`], else the active [`Camera3d`], of the highest order.
/// Entities that are no cameras, such as light probes, use its exposure.
#[derive(SystemParam)]
pub(super) struct ViewingCamera<'w, 's, F: QueryFilter + 'static> {
    cameras: Query<'w, 's, View, (With<Camera3d>, F)>,
}

impl<F: QueryFilter> ViewingCamera<'_, '_, F> {
    fn view(&self) -> Option<(Option<Exposure>, Option<AmbientLight>)> {
        let active = self.cameras.iter().filter(|(camera, ..)| camera.is_active);
        // Cameras that render into images have lower orders than those into windows, so the last one is the player's.
        let view = active.max_by_key(|(camera, is_ar, ..)| (*is_ar, camera.order));
        view.map(|(_, _, exposure, ambient)| (exposure.copied(), ambient.cloned()))
    }

    pub(super) fn exposure(&self) -> Exposure {
        self.view().and_then(|view| view.0).unwrap_or_default()
    }

    pub(super) fn ambient(&self) -> Option<AmbientLight> {
        self.view().and_then(|view| view.1)
    }
}
