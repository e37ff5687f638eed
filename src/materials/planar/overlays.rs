//! The rectangles with the shadows of receivers, entities of their own: below a phantom they would be phantoms too.

use super::planar_material::PlanarMaterial;
use crate::shadows::{PlanarShadow, PlanarTexture};
use bevy::{camera::visibility::RenderLayers, ecs::query::QueryData, light::NotShadowCaster, prelude::*};

/// The rectangle of a receiver.
#[derive(Component, Clone, Debug)]
pub(super) struct PlanarOverlay {
    rectangle: Entity,
    material: Handle<PlanarMaterial>,
}

#[derive(QueryData)]
pub(super) struct ReceiverData {
    entity: Entity,
    texture: Ref<'static, PlanarTexture>,
    visibility: Ref<'static, InheritedVisibility>,
    layers: Option<&'static RenderLayers>,
    overlay: Option<&'static PlanarOverlay>,
}

/// Lays a rectangle over each receiver that has none, and moves the others with their receivers.
pub(super) fn lay_overlays(
    mut commands: Commands,
    receivers: Query<ReceiverData, With<PlanarShadow>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<PlanarMaterial>>,
    mut unit_square: Local<Handle<Mesh>>,
) {
    for receiver in &receivers {
        let has_changed = receiver.texture.is_changed() || receiver.visibility.is_changed();
        if !has_changed && receiver.overlay.is_some() {
            continue;
        }
        let look = PlanarMaterial { ratio: receiver.texture.image.clone() };
        let is_shown = receiver.visibility.get() && receiver.texture.window[1].min_element() > 0.0;
        let visibility = if is_shown { Visibility::Visible } else { Visibility::Hidden };
        let place = place_of(&receiver.texture);
        let rectangle = match receiver.overlay {
            Some(overlay) => {
                if materials.get(&overlay.material).is_some_and(|last| *last != look) {
                    // The lookup that marks as changed comes only where something is.
                    if let Some(mut material) = materials.get_mut(&overlay.material) {
                        *material = look;
                    }
                }
                commands.entity(overlay.rectangle).insert((place, visibility));
                overlay.rectangle
            }
            None => {
                if *unit_square == Handle::default() {
                    *unit_square = meshes.add(Plane3d::default().mesh().size(1.0, 1.0));
                }
                let material = materials.add(look);
                let mesh = (Mesh3d(unit_square.clone()), MeshMaterial3d(material.clone()), NotShadowCaster);
                let rectangle = commands.spawn((Name::new("planar shadow"), mesh, place, visibility)).id();
                commands.entity(receiver.entity).insert(PlanarOverlay { rectangle, material });
                rectangle
            }
        };
        match receiver.layers {
            Some(layers) => commands.entity(rectangle).insert(layers.clone()),
            None => commands.entity(rectangle).remove::<RenderLayers>(),
        };
    }
}

/// Takes the rectangle away with the shadow.
pub(super) fn remove_overlay(
    removed: On<Remove, PlanarShadow>,
    overlays: Query<&PlanarOverlay>,
    mut commands: Commands,
) {
    if let Ok(overlay) = overlays.get(removed.entity) {
        commands.entity(overlay.rectangle).try_despawn();
        commands.entity(removed.entity).try_remove::<(PlanarOverlay, PlanarTexture)>();
    }
}

/// Pose and size of the part of the receiver that the texture covers.
fn place_of(texture: &PlanarTexture) -> Transform {
    let [center, half_size] = texture.window;
    let rotation = texture.world_from_local.rotation;
    let at = Vec3::new(center.x, texture.offset.max(0.0), center.y);
    Transform {
        translation: Vec3::from(texture.world_from_local.translation) + rotation * at,
        rotation,
        scale: Vec3::new(2.0 * half_size.x, 1.0, 2.0 * half_size.y),
    }
}
