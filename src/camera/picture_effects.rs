//! Warnings about effects with which an [`ArCamera`] does not show what the game means: one line each, once.

use super::ArCamera;
use bevy::{
    camera::Hdr,
    core_pipeline::tonemapping::Tonemapping,
    ecs::{
        component::{ComponentId, Components},
        world::EntityRef,
    },
    light::Skybox,
    pbr::AtmosphereSettings,
    platform::collections::HashSet,
    prelude::*,
    render::camera::TemporalJitter,
};

/// Components of crates of the engine that this crate does without, by the paths of their types.
const DEPTH_OF_FIELD: &str = "bevy_post_process::dof::DepthOfField";
const MOTION_BLUR: &str = "bevy_post_process::motion_blur::MotionBlur";

/// Looks up components by the paths of their types.
struct ByPath<'a> {
    components: &'a Components,
    registry: Option<&'a AppTypeRegistry>,
}

impl ByPath<'_> {
    /// Returns whether an entity has a component with a path. Types that nobody registers are not found.
    fn has(&self, entity: &EntityRef, path: &str) -> bool {
        let id = || -> Option<ComponentId> {
            let registry = self.registry?.read();
            self.components.get_id(registry.get_with_type_path(path)?.type_id())
        };
        id().is_some_and(|id| entity.contains_id(id))
    }
}

/// Returns what is wrong with the effects of an `ArCamera`, and what would be right.
fn complaints(camera: &EntityRef, by_path: &ByPath) -> Vec<&'static str> {
    let is_mapped = camera.get::<Tonemapping>().is_some_and(|method| *method != Tonemapping::None);
    let cases = [
        (
            camera.contains::<Hdr>() && is_mapped,
            "Tonemapping together with Hdr changes the camera's frames too. Use Tonemapping::None, or no Hdr, with which \
             only virtual things are tone mapped",
        ),
        (
            camera.get::<Skybox>().is_some_and(|sky| sky.image.is_some()),
            "a Skybox covers the camera's frames. Remove it from the ArCamera",
        ),
        (
            camera.contains::<AtmosphereSettings>(),
            "an atmosphere covers the camera's frames. Remove AtmosphereSettings from the ArCamera",
        ),
        (
            by_path.has(camera, DEPTH_OF_FIELD),
            "DepthOfField has no effect: Bevy computes it for its own perspective projection only, and that of a real \
             camera is off-center",
        ),
        (
            camera.contains::<TemporalJitter>() && by_path.has(camera, MOTION_BLUR),
            "MotionBlur together with temporal antialiasing smears the camera's frames. Use one of them",
        ),
    ];
    cases.into_iter().filter_map(|(is_so, complaint)| is_so.then_some(complaint)).collect()
}

/// Warns once of each effect that does not do on an `ArCamera` what it does elsewhere.
pub(super) fn warn_of_effects(
    cameras: Query<EntityRef, With<ArCamera>>,
    components: &Components,
    registry: Option<Res<AppTypeRegistry>>,
    mut said: Local<HashSet<&'static str>>,
) {
    let by_path = ByPath { components, registry: registry.as_deref() };
    for camera in &cameras {
        for complaint in complaints(&camera, &by_path) {
            if said.insert(complaint) {
                warn!("ArCamera {}: {complaint}.", camera.id());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy_post_process::{dof::DepthOfField, motion_blur::MotionBlur};

    /// What is said about a camera with some components.
    fn about(bundle: impl Bundle) -> Vec<&'static str> {
        let mut world = World::new();
        let registry = AppTypeRegistry::default();
        registry.write().register::<DepthOfField>();
        registry.write().register::<MotionBlur>();
        let camera = world.spawn((ArCamera::default(), bundle)).id();
        let by_path = ByPath { components: world.components(), registry: Some(&registry) };
        complaints(&world.entity(camera), &by_path)
    }

    #[test]
    fn effects_that_keep_the_frames_are_no_reason_to_complain() {
        assert_eq!(about(()), [""; 0]);
        assert_eq!(about(Hdr), [""; 0]);
        assert_eq!(about(Tonemapping::TonyMcMapface), [""; 0]);
        assert_eq!(about(MotionBlur::default()), [""; 0]);
        assert_eq!(about((TemporalJitter::default(), Skybox::default())), [""; 0]);
    }

    #[test]
    fn each_effect_that_does_not_is_named_with_what_would_be_right() {
        let sky = || Skybox { image: Some(Handle::default()), ..default() };
        let cases = [
            (about((Hdr, Tonemapping::TonyMcMapface)), ["Tonemapping", "Tonemapping::None"]),
            (about(sky()), ["Skybox", "Remove"]),
            (about(AtmosphereSettings::default()), ["AtmosphereSettings", "Remove"]),
            (about(DepthOfField::default()), ["DepthOfField", "perspective"]),
            (about((TemporalJitter::default(), MotionBlur::default())), ["MotionBlur", "one of them"]),
        ];
        for (said, expected) in cases {
            assert_eq!(said.len(), 1, "{expected:?}: {said:?}");
            assert!(expected.iter().all(|word| said[0].contains(word)), "{expected:?}: {said:?}");
        }
    }
}
