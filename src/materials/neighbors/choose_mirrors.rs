//! Choice of the meshes that reflect their neighbors: the largest mirrors in the picture.

use super::{
    NeighborReflections, NoNeighborReflections,
    mirror_bounds::{MirrorBounds, is_mirror},
    neighbor_cubes::{MAX_MIRRORS, cube_edge},
    neighbor_probe::{NeighborProbe, probe_of},
};
use crate::{
    camera::{ArCamera, CameraFrame, camera_rank},
    materials::{ImageBasedMaterial, mesh_copy::MeshCopy},
    phantom::{StageRole, nearest},
};
use bevy::{
    camera::{
        primitives::{Aabb, Frustum, Sphere},
        visibility::RenderLayers,
    },
    ecs::system::SystemParam,
    light::{EnvironmentMapLight, LightProbe},
    platform::collections::HashMap,
    prelude::*,
};

/// Minimum width of a mirror in the picture as a fraction of its height.
const MIN_WIDTH: f32 = 0.02;
/// Advantage of a mirror that has a probe over one that has none, so that they do not take turns.
const KEPT_ADVANTAGE: f32 = 1.25;

type MirrorMesh = (
    Entity,
    &'static Aabb,
    &'static GlobalTransform,
    &'static InheritedVisibility,
    &'static StageRole,
    &'static MeshMaterial3d<ImageBasedMaterial>,
);
type SeeingCamera =
    (Entity, &'static Camera, &'static GlobalTransform, &'static Frustum, Option<&'static RenderLayers>);

/// Meshes that may reflect their neighbors, and what speaks against it.
#[derive(SystemParam)]
pub(super) struct Mirrors<'w, 's> {
    meshes: Query<'w, 's, MirrorMesh, (With<Mesh3d>, Without<MeshCopy>)>,
    materials: Res<'w, Assets<ImageBasedMaterial>>,
    parents: Query<'w, 's, &'static ChildOf>,
    refusals: Query<'w, 's, &'static NoNeighborReflections>,
    game_probes:
        Query<'w, 's, &'static GlobalTransform, (With<LightProbe>, With<EnvironmentMapLight>, Without<NeighborProbe>)>,
}

impl Mirrors<'_, '_> {
    /// All mirrors with their bounds.
    fn iter(&self) -> impl Iterator<Item = (Entity, MirrorBounds)> {
        self.meshes.iter().filter_map(|(entity, aabb, place, visibility, role, material)| {
            let material = self.materials.get(material)?;
            let is_candidate = *role == StageRole::Virtual && visibility.get() && is_mirror(&material.base);
            if !is_candidate || nearest(entity, &self.parents, &self.refusals).is_some() {
                return None;
            }
            let bounds = MirrorBounds::new(aabb, &place.affine());
            let is_in = |probe: &GlobalTransform| {
                probe.affine().inverse().transform_point3(bounds.center).abs().max_element() <= 0.5
            };
            (bounds.is_compact() && !self.game_probes.iter().any(is_in)).then_some((entity, bounds))
        })
    }
}

/// Width of a mirror in the picture of a camera as a fraction of its height; 0 outside of the picture, and while the
/// camera pauses.
fn width_in_picture(bounds: &MirrorBounds, camera: &Camera, place: &GlobalTransform, frustum: &Frustum) -> f32 {
    let radius = bounds.half_extents.max_element();
    if !camera.is_active || !frustum.intersects_sphere(&Sphere { center: bounds.center.into(), radius }, false) {
        return 0.0;
    }
    let distance = place.translation().distance(bounds.center).max(radius);
    camera.clip_from_view().y_axis.y.abs() * radius / distance
}

/// Gives probes to the largest mirrors, and takes those of all others.
pub(super) fn choose_mirrors(
    mut commands: Commands,
    settings: Res<NeighborReflections>,
    cameras: Query<SeeingCamera, (With<ArCamera>, With<CameraFrame>)>,
    probes: Query<(Entity, &NeighborProbe)>,
    mirrors: Mirrors,
) {
    let mut kept: HashMap<Entity, (Entity, u32)> = HashMap::default();
    for (entity, probe) in &probes {
        if settings.is_changed() {
            commands.entity(entity).despawn();
        } else {
            kept.insert(probe.mirror, (entity, probe.slot));
        }
    }
    let limit = (settings.max_probes as usize).min(MAX_MIRRORS);
    // Those that pause too, so that their mirrors stay as they are.
    let seeing: Vec<_> = cameras.iter().collect();
    let layers = seeing.iter().min_by_key(|(entity, camera, ..)| camera_rank(*entity, camera)).and_then(|view| view.4);
    let mut chosen: Vec<(f32, Entity, MirrorBounds)> = Vec::new();
    if limit > 0 && !seeing.is_empty() {
        for (mirror, bounds) in mirrors.iter() {
            let widths =
                seeing.iter().map(|(_, camera, place, frustum, _)| width_in_picture(&bounds, camera, place, frustum));
            let width = widths.fold(0.0, f32::max);
            let is_kept = kept.contains_key(&mirror);
            if width >= MIN_WIDTH || is_kept {
                chosen.push((if is_kept { width * KEPT_ADVANTAGE } else { width }, mirror, bounds));
            }
        }
        chosen.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        chosen.truncate(limit);
    }
    let mut is_free = [true; MAX_MIRRORS];
    for (_, slot) in chosen.iter().filter_map(|(_, mirror, _)| kept.get(mirror)) {
        is_free[*slot as usize] = false;
    }
    let mut free = (0..MAX_MIRRORS as u32).filter(|slot| is_free[*slot as usize]);
    for (_, mirror, bounds) in chosen {
        if kept.remove(&mirror).is_none()
            && let Some(slot) = free.next()
        {
            commands.spawn(probe_of(mirror, slot, &bounds, cube_edge(&settings), layers));
        }
    }
    for (probe, _) in kept.into_values() {
        commands.entity(probe).despawn();
    }
}
