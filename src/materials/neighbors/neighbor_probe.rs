//! Scene probes of mirrors: their places and their phantoms.

use super::mirror_bounds::MirrorBounds;
use crate::{
    materials::{ShowPhantoms, phantom::MAX_OCCLUDERS, phantom_views::BeyondFrame},
    phantom::{PhantomObject, StageRole},
    prefilter::{SceneCube, SceneProbe},
    probe::LightProbeSphere,
};
use bevy::{
    camera::{primitives::Aabb, visibility::RenderLayers},
    prelude::*,
};

/// Faces of a cube.
pub(super) const FACES: u32 = 6;
/// Frames from the last face of a cube to its maps: it is rendered in the next frame, filtered in the one after that.
pub(super) const FILTER_FRAMES: u32 = 3;

/// Scene probe of a mirror. It lights nothing itself: the material of the mirror reads its maps.
#[derive(Component)]
pub(super) struct NeighborProbe {
    /// Mesh that reflects.
    pub(super) mirror: Entity,
    /// Place in the buffer of all mirrors.
    pub(super) slot: u32,
    /// Faces to be rendered until all of them show the last change.
    pub(super) faces_left: u32,
    /// Frames since the first round of faces was rendered.
    pub(super) frames_since_first_round: Option<u32>,
    /// Number of the maps that were packed last, and how often maps were packed.
    pub(super) packed: Option<u32>,
    pub(super) packs: u32,
}

impl NeighborProbe {
    /// Faces left of the round that has begun, or of the next one.
    pub(super) fn faces_left_of_round(&self) -> u32 {
        match self.faces_left % FACES {
            0 => FACES.min(self.faces_left),
            left => left,
        }
    }
}

/// Components of the probe of a mirror, which is an entity of its own.
pub(super) fn probe_of(
    mirror: Entity,
    slot: u32,
    bounds: &MirrorBounds,
    edge: u32,
    layers: Option<&RenderLayers>,
) -> impl Bundle + use<> {
    (
        Name::new("neighbor probe"),
        NeighborProbe { mirror, slot, faces_left: FACES, frames_since_first_round: None, packed: None, packs: 0 },
        SceneProbe { edge, faces_per_frame: 0, near: bounds.near(), ..default() },
        Transform::from_translation(bounds.center),
        layers.cloned().unwrap_or_default(),
    )
}

type Mirror = (&'static Aabb, &'static GlobalTransform);
type PlacedProbe = (&'static mut NeighborProbe, &'static mut Transform, &'static mut GlobalTransform);

/// Moves probes with their mirrors.
pub(super) fn place_probes(mirrors: Query<Mirror, Without<NeighborProbe>>, mut probes: Query<PlacedProbe>) {
    for (mut probe, mut transform, mut global) in &mut probes {
        if let Ok((aabb, place)) = mirrors.get(probe.mirror) {
            let placed = Transform::from_translation(MirrorBounds::new(aabb, &place.affine()).center);
            transform.set_if_neq(placed);
            global.set_if_neq(placed.into());
        }
        if let Some(frames) = &mut probe.frames_since_first_round {
            *frames = frames.saturating_add(1);
        }
    }
}

type Phantom = (&'static StageRole, &'static Aabb, &'static GlobalTransform);

/// Boxes of the phantoms nearest to a place that hide other things.
fn occluders_near(place: Vec3, phantoms: &Query<Phantom>) -> [Mat4; MAX_OCCLUDERS] {
    let mut boxes: Vec<(f32, Mat4)> = Vec::new();
    for (role, aabb, world_from_mesh) in phantoms {
        if let StageRole::Phantom(PhantomObject { casts: true, .. }) = role {
            let mesh_from_box = Mat4::from_translation(aabb.center.into())
                * Mat4::from_scale(Vec3::from(aabb.half_extents).max(Vec3::splat(1e-4)));
            let world_from_box = Mat4::from(world_from_mesh.affine()) * mesh_from_box;
            let distance = place.distance_squared(world_from_box.w_axis.truncate());
            boxes.push((distance, world_from_box.inverse()));
        }
    }
    boxes.sort_by(|a, b| a.0.total_cmp(&b.0));
    std::array::from_fn(|i| boxes.get(i).map_or(Mat4::ZERO, |(_, matrix)| *matrix))
}

type SeeingProbe = (&'static SceneCube, &'static GlobalTransform);

/// Makes the faces of probes see phantoms, also where the frame does not show them.
pub(super) fn show_phantoms_in_faces(
    mut commands: Commands,
    probes: Query<SeeingProbe, With<NeighborProbe>>,
    spheres: Query<(Entity, &LightProbeSphere, &GlobalTransform)>,
    phantoms: Query<Phantom>,
    cameras: Query<(Has<ShowPhantoms>, Option<&BeyondFrame>)>,
) {
    let bright = spheres.iter().filter(|(_, sphere, _)| !sphere.is_dark());
    let captured_from = bright.min_by_key(|(entity, ..)| *entity).map(|(.., place)| place.translation());
    for (cube, place) in &probes {
        let beyond = captured_from.map(|captured_from| BeyondFrame {
            captured_from,
            occluders: occluders_near(place.translation(), &phantoms),
        });
        for camera in cube.cameras {
            let Ok((shows_phantoms, current)) = cameras.get(camera) else { continue };
            if !shows_phantoms {
                commands.entity(camera).insert(ShowPhantoms::default());
            }
            match beyond {
                Some(beyond) if current != Some(&beyond) => {
                    commands.entity(camera).insert(beyond);
                }
                None if current.is_some() => {
                    commands.entity(camera).remove::<BeyondFrame>();
                }
                _ => (),
            }
        }
    }
}
