//! The phantoms of the desk as solids in world space, for the solver.

use super::solver::PhantomSolid;
use crate::{
    phantom::{PhantomObject, StageRole},
    probe::LightProbeSphere,
};
use bevy::{math::Affine3A, prelude::*};
use std::sync::Arc;

/// The phantoms in world space.
#[derive(Resource, Default)]
pub(super) struct DeskSolids {
    pub(super) solids: Arc<Vec<PhantomSolid>>,
    made_from: Vec<(AssetId<Mesh>, Affine3A, PhantomObject)>,
}

/// Largest change of an entry of a phantom's transform that does not count as motion. Meters for the translation; for
/// the rotation, meters per meter of lever arm.
const MAX_PHANTOM_MOTION: f32 = 1e-3;
/// Radius of the largest sphere in which a mesh counts as a stand-in for the ball itself, in radii of the ball.
const MAX_PROXY_RADIUS: f32 = 1.1;

/// Rebuilds the solids when a phantom has appeared, changed, moved or vanished.
pub(super) fn collect_phantoms(
    mut desk: ResMut<DeskSolids>,
    meshes: Option<Res<Assets<Mesh>>>,
    phantoms: Query<(&Mesh3d, &GlobalTransform, &StageRole)>,
    balls: Query<(&LightProbeSphere, &GlobalTransform)>,
) {
    let Some(meshes) = meshes else {
        return;
    };
    let mut found = Vec::new();
    for (mesh, transform, role) in &phantoms {
        // Meshes that are still loading are left out.
        if let (StageRole::Phantom(phantom), Some(_)) = (role, meshes.get(&mesh.0)) {
            found.push((mesh.0.id(), transform.affine(), *phantom));
        }
    }
    let is_near = |a: &Affine3A, b: &Affine3A| a.abs_diff_eq(*b, MAX_PHANTOM_MOTION);
    let is_current = found.len() == desk.made_from.len()
        && found.iter().zip(&desk.made_from).all(|(a, b)| a.0 == b.0 && a.2 == b.2 && is_near(&a.1, &b.1));
    if is_current {
        return;
    }
    let is_ball = |solid: &PhantomSolid| {
        balls.iter().any(|(ball, transform)| solid.is_within(transform.translation(), MAX_PROXY_RADIUS * ball.radius))
    };
    let solids = found.iter().filter_map(|(mesh, transform, phantom)| {
        let mut solid = PhantomSolid::from_mesh(meshes.get(*mesh)?, transform).filter(|solid| !is_ball(solid))?;
        (solid.casts, solid.receives) = (phantom.casts, phantom.receives);
        solid.reflectance = phantom.reflectance.filter(|reflectance| {
            let is_valid = reflectance.cmpgt(Vec3::ZERO).all() && reflectance.cmple(Vec3::ONE).all();
            if !is_valid {
                warn!(
                    "PhantomObject.reflectance is {reflectance}, which is ignored; each channel has to be above 0 \
                     and at most 1"
                );
            }
            is_valid
        });
        Some(solid)
    });
    desk.solids = Arc::new(solids.collect());
    desk.made_from = found;
}
