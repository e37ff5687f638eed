//! What a source of the environment cube shows, and from where.

use super::{unwrap_pipeline::UnwrapPipelineKey, unwrap_uniform::UnwrapUniform};
use crate::{
    lighting::ClipGains,
    probe::{LensView, ProbeLens, ProbeView, Surroundings},
};
use bevy::prelude::*;
use std::sync::Arc;

/// Confidence of an environment that nobody has measured.
const FALLBACK_CONFIDENCE: f32 = 0.002;

/// View of one source. It is compared to detect whether the source has to be unwrapped again.
#[derive(Clone, PartialEq)]
pub(super) enum SourceView {
    /// A ball, the gains of clipped light, and what is around the ball.
    Ball(ProbeView, Option<ClipGains>, Arc<Surroundings>),
    /// The frame of a probe camera.
    Lens(LensView),
    /// The fallback: its image, version and size in pixels.
    Fallback(AssetId<Image>, u32, UVec2),
}

impl SourceView {
    pub(super) fn key(&self) -> UnwrapPipelineKey {
        match self {
            Self::Ball(..) => UnwrapPipelineKey::Ball,
            Self::Lens(view) => match view.lens {
                ProbeLens::Fisheye { .. } => UnwrapPipelineKey::Fisheye,
                ProbeLens::Equirect => UnwrapPipelineKey::Equirect,
                ProbeLens::SphereMap { .. } => UnwrapPipelineKey::SphereMap,
            },
            Self::Fallback(..) => UnwrapPipelineKey::Equirect,
        }
    }

    pub(super) fn is_fallback(&self) -> bool {
        matches!(self, Self::Fallback(..))
    }

    /// Uniform without history, except for the factor on what a ball showed earlier.
    pub(super) fn uniform(&self, history_scale: Vec3) -> UnwrapUniform {
        match self {
            Self::Ball(view, gains, around) => {
                let mut uniform = UnwrapUniform::of_ball(view);
                uniform.gains_by_direction = if gains.is_some() { 1.0 } else { 0.0 };
                uniform.has_solids = if around.shown.is_empty() { 0.0 } else { 1.0 };
                uniform.history_scale = history_scale;
                uniform
            }
            Self::Lens(view) => UnwrapUniform::of_lens(view.numbers, view.camera_from_world, view.gain),
            Self::Fallback(_, _, size) => {
                let numbers = ProbeLens::Equirect.numbers(*size);
                let mut uniform = UnwrapUniform::of_lens(numbers, Mat3::IDENTITY, Vec3::ONE);
                uniform.confidence = 0.0;
                uniform.min_confidence = FALLBACK_CONFIDENCE;
                uniform
            }
        }
    }
}
