//! Input of the solver: a frame and the things that are known to stand in it.

use super::ray_cast::{PhantomSolid, sphere_is_hit};
use crate::{
    camera::{FramePixels, Intrinsics, PosedFrame},
    probe::BallSurface,
};
use glam::{Affine3A, Vec3};
use std::sync::Arc;

/// Everything that is known about a desk when a frame of it was taken.
#[derive(Clone, Debug)]
pub struct DeskFrame {
    /// The frame.
    pub frame: Arc<FramePixels>,
    /// Intrinsics of the camera for frames of this size.
    pub intrinsics: Intrinsics,
    /// World → camera (Bevy axes), rigid.
    pub camera_from_world: Affine3A,
    /// The mirrored ball that shows the sky.
    pub ball: MirrorBall,
    /// Other mirrored balls. Darker balls reveal the brightness of lamps that the first ball shows clipped; a second
    /// ball reveals the position of lamps.
    pub other_balls: Vec<MirrorBall>,
    /// Underexposed frames of the same desk. They serve the same purpose as darker balls.
    pub bracketed_exposures: Vec<BracketedExposure>,
    /// Marker sheets that were detected in this frame.
    pub papers: Vec<Paper>,
    /// Other real objects, including the desk itself.
    pub phantoms: Arc<Vec<PhantomSolid>>,
    /// Largest gain on clipped light.
    pub max_gain: f32,
}

/// An underexposed frame of the desk of a [`DeskFrame`], taken at about the same time.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{camera::FramePixels, lighting::solver::{BracketedExposure, DeskFrame}};
/// # fn with_bracket(desk: DeskFrame, eighth: FramePixels, sixtieth: FramePixels) -> DeskFrame {
/// // The exposure of the main frame is 1/30 s.
/// let bracket = vec![BracketedExposure::new(eighth, 1.0 / 8.0), BracketedExposure::new(sixtieth, 1.0 / 60.0)];
/// DeskFrame { bracketed_exposures: bracket, ..desk }
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct BracketedExposure {
    /// The frame: from the same camera with the same zoom and cropping. Its size may differ.
    pub frame: Arc<FramePixels>,
    /// Exposure relative to the main frame, above 0 and below 1. Frames with other values are ignored. 1/4 to 1/64 are
    /// most useful; below, cameras have hardly a quantization step for what is as bright as white.
    pub exposure: f32,
    /// World → camera when it was taken (Bevy axes), rigid. Defaults to `None`: the same as in the main frame.
    pub camera_from_world: Option<Affine3A>,
}

impl BracketedExposure {
    /// Creates an exposure that was taken from the same pose as the main frame.
    pub fn new(frame: impl Into<Arc<FramePixels>>, exposure: f32) -> Self {
        Self { frame: frame.into(), exposure, camera_from_world: None }
    }
}

/// Printed sheet of a marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paper {
    /// Marker frame → world.
    pub world_from_marker: Affine3A,
    /// Side of the black square, meters.
    pub size: f32,
    /// Fraction of light that the white margin reflects, 0…1.
    pub reflectance: f32,
}

/// A mirrored ball on the desk, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MirrorBall {
    /// Center, meters.
    pub center: Vec3,
    /// Radius, meters.
    pub radius: f32,
    /// Fraction of light that the ball mirrors, 0…1; at normal incidence if it depends on the angle.
    pub reflectance: f32,
    /// Kind of the surface, which determines whether the reflectance depends on the angle.
    pub surface: BallSurface,
}

impl DeskFrame {
    /// All balls; the first one shows the sky.
    pub(super) fn balls(&self) -> Vec<MirrorBall> {
        std::iter::once(self.ball).chain(self.other_balls.iter().copied()).collect()
    }

    /// The main frame with its pose.
    pub(super) fn posed_frame(&self) -> PosedFrame<'_> {
        let Self { frame, intrinsics, camera_from_world, .. } = self;
        PosedFrame { frame, intrinsics: *intrinsics, camera_from_world: *camera_from_world, exposure: 1.0 }
    }

    /// The usable bracketed frames with their poses.
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

/// The objects on the desk.
#[derive(Clone, Copy)]
pub(super) struct DeskGeometry<'a> {
    pub balls: &'a [MirrorBall],
    pub papers: &'a [Paper],
    pub phantoms: &'a [PhantomSolid],
}

impl DeskGeometry<'_> {
    /// Whether a ball blocks a ray.
    pub(super) fn is_hidden_by_ball(&self, origin: Vec3, dir: Vec3) -> bool {
        self.balls.iter().any(|ball| sphere_is_hit(ball.center - origin, ball.radius, dir))
    }

    /// Whether a ball or a phantom that casts shadows blocks a ray. `guesses` holds the triangle last hit, per phantom.
    pub(super) fn is_hidden(&self, origin: Vec3, dir: Vec3, guesses: &mut [usize]) -> bool {
        let mut phantoms = self.phantoms.iter().zip(guesses);
        self.is_hidden_by_ball(origin, dir)
            || phantoms.any(|(phantom, guess)| phantom.casts && phantom.is_hit(origin, dir, guess))
    }
}
