//! Bounced light: what virtual and real things send to each other, past the shadow maps.
//!
//! The surfaces of casters are divided into *surfels*: small discs with a position, a normal, an area and a color. This
//! module forms them on the CPU; `render/surfel_pass.wgsl` lights them, and `render/surfels.wgsl` sums the light that
//! they send to a point.

mod albedo;
mod deformation;
mod frame_light;
mod mesh_surfels;

pub(crate) use albedo::SurfaceAlbedo;

use super::{bounding_sphere::BoundingSphere, casters::Caster, dome_light::ShadowDomeLight, fitted_dome::FittedDome};
use bevy::{
    math::{Affine3A, Mat3A},
    platform::collections::HashMap,
    prelude::*,
    render::render_resource::ShaderType,
};
use deformation::Deformation;
use frame_light::FrameLight;
use mesh_surfels::{MeshSurfel, mesh_surfels};
use std::sync::Arc;

/// Flags of a [`Surfel`]. Twins of the constants in `surfel_pass.wgsl`.
const IS_VIRTUAL: u32 = 1;
const IS_VISIBLE: u32 = 2;
/// Bits above which the number of the phantom stands.
const PHANTOM_SHIFT: u32 = 8;
/// Largest number of phantoms whose albedo is estimated; the others send no light. Twin of the constant in
/// `surfel_pass.wgsl`.
pub(super) const MAX_PHANTOMS: usize = 64;
/// Numbers of surfels that a caster can have: few, so that it keeps its surfels while casters come and go.
const PER_CASTER: [usize; 10] = [8, 12, 16, 24, 32, 48, 64, 96, 128, 192];

/// Disc that stands for a patch of a surface, in world space. Mirror of `Surfel` in `surfel_pass.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Surfel {
    pub(super) position: Vec3,
    /// Square meters.
    pub(super) area: f32,
    pub(super) normal: Vec3,
    pub(super) flags: u32,
    /// Of a virtual surfel the albedo, of a visible one of a phantom its radiance in the camera's frame.
    pub(super) color: Vec3,
}

/// All surfels of this frame.
#[derive(Resource, Clone, Debug, Default, PartialEq)]
pub(super) struct Surfels {
    pub(super) list: Arc<Vec<Surfel>>,
    /// Number of phantoms with surfels.
    pub(super) phantoms: u32,
    /// Whether every phantom that casts has surfels, which then give the light of the directions that it hides.
    pub(super) covers_phantoms: bool,
}

/// Surfels of meshes in their own frame, by mesh and number.
#[derive(Default)]
pub(super) struct MeshCache {
    surfels: HashMap<(AssetId<Mesh>, usize), Arc<Vec<MeshSurfel>>>,
}

impl MeshCache {
    fn surfels(&mut self, id: AssetId<Mesh>, count: usize, mesh: &Mesh) -> Arc<Vec<MeshSurfel>> {
        Arc::clone(self.surfels.entry((id, count)).or_insert_with(|| mesh_surfels(mesh, count).into()))
    }

    /// Forgets meshes that have changed.
    fn follow(&mut self, changes: &mut MessageReader<AssetEvent<Mesh>>) {
        for change in changes.read() {
            if let AssetEvent::Modified { id } | AssetEvent::Removed { id } = change {
                self.surfels.retain(|(mesh, _), _| mesh != id);
            }
        }
    }
}

/// Color of a surface, for its surfels.
#[derive(Clone, Copy)]
enum Paint<'a> {
    Virtual(Vec3),
    /// Of a phantom with its number in the flags.
    Phantom(u32, &'a FrameLight<'a>),
}

impl Paint<'_> {
    fn surfel(self, position: Vec3, area_vector: Vec3) -> Surfel {
        let (normal, area) = area_vector.normalize_and_length();
        let (color, flags) = match self {
            Self::Virtual(albedo) => (albedo, IS_VIRTUAL),
            Self::Phantom(flags, frame) => match frame.at(position, normal) {
                Some(light) => (light, IS_VISIBLE | flags),
                None => (Vec3::ZERO, flags),
            },
        };
        Surfel { position, area, normal, flags, color }
    }
}

/// Surfels of a caster in world space.
fn caster_surfels(caster: &Caster, mesh: &Mesh, surfels: &[MeshSurfel], paint: Paint, list: &mut Vec<Surfel>) {
    let place = Affine3A::from_mat4(caster.world_from_local);
    let (x, y, z) = (place.matrix3.x_axis, place.matrix3.y_axis, place.matrix3.z_axis);
    // The cofactors turn areas as the matrix turns edges, uneven scale included. Mirrored triangles are drawn turned.
    let cofactors = Mat3A::from_cols(y.cross(z), z.cross(x), x.cross(y)) * place.matrix3.determinant().signum();
    let deformation = Deformation::of(caster, mesh);
    for surfel in surfels {
        let (position, area_vector) = match &deformation {
            Some(deformation) => deformation.place(surfel),
            None => (place.transform_point3(surfel.position), cofactors * surfel.area_vector),
        };
        let area = area_vector.length();
        if area > 0.0 && area.is_finite() && position.is_finite() {
            list.push(paint.surfel(position, area_vector));
        }
    }
}

/// Number of surfels of a caster: its part of all, by size.
fn surfels_of(caster: &Caster, sizes: f32, limit: usize) -> usize {
    let part = limit as f32 * caster.sphere.radius / sizes.max(f32::MIN_POSITIVE);
    let fitting = PER_CASTER.iter().rev().find(|count| **count as f32 <= part);
    fitting.copied().unwrap_or(PER_CASTER[0])
}

/// Forms the surfels of all casters.
pub(super) fn collect_surfels(
    mut collected: ResMut<Surfels>,
    fitted: Res<FittedDome>,
    domes: Query<&ShadowDomeLight>,
    albedos: Query<&SurfaceAlbedo>,
    frames: frame_light::Frames,
    meshes: Res<Assets<Mesh>>,
    mut mesh_changes: MessageReader<AssetEvent<Mesh>>,
    mut cache: Local<MeshCache>,
) {
    cache.follow(&mut mesh_changes);
    let limit = domes.iter().next().map_or(0, ShadowDomeLight::clamped_surfels) as usize;
    let objects: Vec<BoundingSphere> = fitted.casters.iter().filter(|c| !c.is_phantom).map(|c| c.sphere).collect();
    // Without virtual things the real ones have lit each other already.
    if limit == 0 || objects.is_empty() {
        collected.set_if_neq(Surfels::default());
        return;
    }
    let frame = frames.newest();
    let sizes: f32 = fitted.casters.iter().map(|caster| caster.sphere.radius).sum();
    let (mut list, mut phantoms, mut covers_phantoms) = (vec![], 0, true);
    // Phantoms first: without surfels of their own, they would have to be as bright as the map below the horizon.
    let of_kind = |is_phantom| fitted.casters.iter().filter(move |caster| caster.is_phantom == is_phantom);
    for caster in of_kind(true).chain(of_kind(false)) {
        let mesh = meshes.get(caster.mesh);
        let fits = |surfels: &Arc<Vec<MeshSurfel>>| !surfels.is_empty() && list.len() + surfels.len() <= limit;
        let count = surfels_of(caster, sizes, limit);
        let surfels = mesh.map(|mesh| cache.surfels(caster.mesh, count, mesh)).filter(fits);
        let (Some(mesh), Some(surfels)) = (mesh, surfels) else {
            covers_phantoms &= !caster.is_phantom;
            continue;
        };
        let paint = if !caster.is_phantom {
            Paint::Virtual(albedos.get(caster.entity).map_or(SurfaceAlbedo::default(), |albedo| *albedo).0)
        } else if phantoms < MAX_PHANTOMS as u32 {
            phantoms += 1;
            Paint::Phantom((phantoms - 1) << PHANTOM_SHIFT, &frame)
        } else {
            covers_phantoms = false;
            continue;
        };
        caster_surfels(caster, mesh, &surfels, paint, &mut list);
    }
    collected.set_if_neq(Surfels { list: list.into(), phantoms, covers_phantoms });
}
