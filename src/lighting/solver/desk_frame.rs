//! What goes into the solver: a picture, and what is known to stand in it.

use super::ray_cast::{PhantomSolid, sphere_is_hit};
use crate::{
    camera::{FramePixels, Intrinsics, PosedFrame},
    probe::BallSurface,
};
use bevy::{math::Affine3A, prelude::*};
use std::sync::Arc;

/// Everything that is known of a desk when a picture of it has been taken.
#[derive(Clone, Debug)]
pub struct DeskFrame {
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
    /// Pictures of the same desk that got less light: they tell the same as darker balls.
    pub bracketed_exposures: Vec<BracketedExposure>,
    /// Sheets of markers that were seen in this picture.
    pub papers: Vec<Paper>,
    /// Other real things, the desk itself included.
    pub phantoms: Arc<Vec<PhantomSolid>>,
    /// Most that clipped light is multiplied with.
    pub max_gain: f32,
}

/// The desk of a [`DeskFrame`] at a shorter exposure, taken at about the same time.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{camera::FramePixels, lighting::solver::{DeskFrame, BracketedExposure}};
/// # fn with_series(picture: DeskFrame, eighth: FramePixels, sixtieth: FramePixels) -> DeskFrame {
/// // 1/30 s was the picture's own exposure
/// let shorter = vec![BracketedExposure::new(eighth, 1.0 / 8.0), BracketedExposure::new(sixtieth, 1.0 / 60.0)];
/// DeskFrame { shorter_exposures: shorter, ..picture }
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct BracketedExposure {
    /// The picture. Of the same camera, zoom and cropping; its size may be another.
    pub frame: Arc<FramePixels>,
    /// Light it got, the main picture's being 1: above 0 and below 1. Pictures with other numbers are ignored. 1/4 to 1/64 tell
    /// most: below, cameras have hardly a step for what is as bright as white.
    pub exposure: f32,
    /// World → camera when it was taken (Bevy axes), rigid. Defaults to `None`: as in the main picture.
    pub camera_from_world: Option<Affine3A>,
}

impl BracketedExposure {
    /// A picture taken from where the main one was taken.
    pub fn new(frame: impl Into<Arc<FramePixels>>, exposure: f32) -> Self {
        Self { frame: frame.into(), exposure, camera_from_world: None }
    }
}

/// A marker's printed sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paper {
    /// Marker frame → world.
    pub world_from_marker: Affine3A,
    /// Side of the black square in metres.
    pub size: f32,
    /// Share of light the white margin reflects, 0…1.
    pub reflectance: f32,
}

/// A mirrored ball on the desk, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorBall {
    /// Center, metres.
    pub center: Vec3,
    /// Radius in metres.
    pub radius: f32,
    /// Share of light it mirrors, 0…1; perpendicular to its surface if that depends on the angle.
    pub reflectance: f32,
    /// Whether it does.
    pub surface: BallSurface,
}

impl DeskFrame {
    /// All balls, the one that shows the sky first.
    pub(super) fn balls(&self) -> Vec<MirrorBall> {
        std::iter::once(self.ball).chain(self.other_balls.iter().copied()).collect()
    }

    /// The main picture.
    pub(super) fn posed_frame(&self) -> PosedFrame<'_> {
        let Self { frame, intrinsics, camera_from_world, .. } = self;
        PosedFrame { frame, intrinsics: *intrinsics, camera_from_world: *camera_from_world, exposure: 1.0 }
    }

    /// The pictures that got less light.
    pub(super) fn posed_bracketed_frames(&self) -> impl Iterator<Item = PosedFrame<'_>> {
        let usable =
            self.bracketed_exposures.iter().filter(|bracketed| bracketed.exposure > 0.0 && bracketed.exposure < 1.0);
        usable.map(|bracketed| PosedFrame {
            frame: &bracketed.frame,
            intrinsics: self.intrinsics.scaled_to(bracketed.frame.size),
            camera_from_world: bracketed.camera_from_world.unwrap_or(self.camera_from_world),
            exposure: bracketed.exposure,
        })
    }
}

/// What stands on the desk.
#[derive(Clone, Copy)]
pub(super) struct DeskGeometry<'a> {
    pub balls: &'a [MirrorBall],
    pub papers: &'a [Paper],
    pub phantoms: &'a [PhantomSolid],
}

impl DeskGeometry<'_> {
    pub(super) fn is_hidden_by_ball(&self, origin: Vec3, dir: Vec3) -> bool {
        self.balls.iter().any(|ball| sphere_is_hit(ball.center - origin, ball.radius, dir))
    }

    pub(super) fn is_hidden(&self, origin: Vec3, dir: Vec3, guesses: &mut [usize]) -> bool {
        let mut phantoms = self.phantoms.iter().zip(guesses);
        self.is_hidden_by_ball(origin, dir)
            || phantoms.any(|(phantom, guess)| phantom.casts && phantom.is_hit(origin, dir, guess))
    }
}
