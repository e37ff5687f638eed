//! What goes into the solver: a picture, and what is known to stand in it.

use super::{
    find::FoundLight,
    meter::{MirrorBall, Paper},
    ray_cast::PhantomSolid,
    solved_light::SolvedLight,
    triangulate::triangulate,
};
use crate::camera::{FramePixels, Intrinsics};
use bevy::{math::Affine3A, prelude::*};
use std::sync::Arc;

/// Everything that is known of a desk when a picture of it has been taken.
#[derive(Clone, Debug)]
pub struct DeskPicture {
    /// The picture.
    pub frame: Arc<FramePixels>,
    /// The camera's, for pictures of this size.
    pub intrinsics: Intrinsics,
    /// World → camera (Bevy axes), rigid.
    pub camera_from_world: Affine3A,
    /// The mirrored ball.
    pub ball: MirrorBall,
    /// Other mirrored balls. Darker ones tell how bright the lamps are that the first one shows clipped; two balls tell where lamps
    /// are.
    pub other_balls: Vec<MirrorBall>,
    /// Sheets of markers that were seen in this picture.
    pub papers: Vec<Paper>,
    /// Other real things, the desk itself included.
    pub phantoms: Arc<Vec<PhantomSolid>>,
    /// Most that clipped light is multiplied with.
    pub max_gain: f32,
}

impl DeskPicture {
    /// The lights of a solution for this picture, strongest first: [`SolvedLight::lights`] with the places that a second ball tells of.
    pub fn lights(&self, solved: &SolvedLight) -> Vec<FoundLight> {
        let mut lights = solved.lights();
        triangulate(self, &mut lights);
        lights
    }

    /// All balls, the one that shows the sky first.
    pub(super) fn balls(&self) -> Vec<MirrorBall> {
        std::iter::once(self.ball).chain(self.other_balls.iter().copied()).collect()
    }
}
