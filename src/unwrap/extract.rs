//! Sources of the environment cube, copied from the main world to the render world.

use super::source_view::SourceView;
use crate::{
    camera::{CameraFrame, FrameTexture},
    environment_map::EnvironmentCube,
    lighting::ClipGains,
    probe::{EnvironmentOrigin, FallbackImage, HistoryHint, LensView, ProbeMeasurement},
};
use bevy::{prelude::*, render::Extract};
use std::time::Duration;

/// Sources of the environment cube, in the order in which they are merged.
#[derive(Resource, Default)]
pub(super) struct ExtractedSources {
    pub(super) cube: Option<AssetId<Image>>,
    pub(super) sources: Vec<ExtractedSource>,
    /// Fraction of the transition from the fallback to the measured environment that is due now.
    pub(super) measured_fraction: f32,
}

/// One frame or image that is unwrapped into the cube.
pub(super) struct ExtractedSource {
    pub(super) entity: Entity,
    pub(super) frame: AssetId<Image>,
    pub(super) sequence: u64,
    pub(super) captured: Duration,
    pub(super) view: SourceView,
    /// Factor on what was seen earlier.
    pub(super) scale: Vec3,
    /// Fraction by which the visible surroundings have changed since the frame before.
    pub(super) change: f32,
}

type SeenBall =
    (Entity, &'static ProbeMeasurement, &'static HistoryHint, &'static EnvironmentCube, Option<&'static ClipGains>);
type SeenFrame = (Entity, &'static LensView, &'static CameraFrame, &'static FrameTexture, &'static EnvironmentCube);

pub(super) fn extract_sources(
    mut extracted: ResMut<ExtractedSources>,
    probes: Extract<Query<SeenBall>>,
    lenses: Extract<Query<SeenFrame>>,
    fallbacks: Extract<Query<(Entity, &FallbackImage, &EnvironmentOrigin, &EnvironmentCube)>>,
    cameras: Extract<Query<&FrameTexture>>,
) {
    extracted.sources.clear();
    extracted.measured_fraction = 1.0;
    let mut shared_cube = None;
    // All cameras share the cube: of several fallbacks the one that knows most counts.
    let fallback =
        fallbacks.iter().max_by_key(|(entity, _, origin, _)| (origin.knowledge(), std::cmp::Reverse(*entity)));
    if let Some((entity, fallback, _, cube)) = fallback {
        shared_cube = Some(cube.0.id());
        extracted.measured_fraction = fallback.measured_fraction;
        if fallback.measured_fraction < 1.0 {
            extracted.sources.push(ExtractedSource {
                entity,
                frame: fallback.image.id(),
                sequence: 0,
                captured: Duration::ZERO,
                view: SourceView::Fallback(fallback.image.id(), fallback.version, fallback.size),
                scale: Vec3::ONE,
                change: 0.0,
            });
        }
    }
    for (entity, measurement, hint, cube, gains) in &probes {
        shared_cube = Some(cube.0.id());
        let Some(view) = measurement.view else { continue };
        let Ok(texture) = cameras.get(view.camera) else { continue };
        let gains = gains.filter(|gains| gains.0.len() == ClipGains::COUNT).cloned();
        extracted.sources.push(ExtractedSource {
            entity,
            frame: texture.image.id(),
            sequence: measurement.sequence,
            captured: hint.captured,
            view: SourceView::Ball(view, gains, hint.surroundings.clone()),
            scale: hint.scale,
            change: hint.change,
        });
    }
    for (entity, view, frame, texture, cube) in &lenses {
        shared_cube = Some(cube.0.id());
        extracted.sources.push(ExtractedSource {
            entity,
            frame: texture.image.id(),
            sequence: view.sequence,
            captured: frame.captured,
            view: SourceView::Lens(*view),
            scale: Vec3::ONE,
            change: 0.0,
        });
    }
    extracted.cube = shared_cube;
}
