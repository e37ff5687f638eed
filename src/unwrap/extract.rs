//! What the unwrap pass takes its light from, as the shader wants it.

use crate::{
    camera::{CameraFrame, FrameTexture},
    environment_map::EnvironmentCube,
    lighting::ClipGains,
    probe::{
        FallbackPicture, Glance, LensNumbers, LensView, MOST_SATURATION, ProbeLens, ProbeMeasurement, ProbeView,
        Surroundings, WHITE_FROM, clipped_from_linear,
    },
};
use bevy::{
    prelude::*,
    render::{Extract, render_resource::ShaderType},
};
use std::{sync::Arc, time::Duration};

/// Confidence of an environment that nobody has measured.
const FALLBACK_CONFIDENCE: f32 = 0.002;

/// Mirror of `Ball` in `mirror_ball.wgsl`.
#[derive(ShaderType, Clone, Copy)]
struct BallUniform {
    center_camera: Vec3,
    radius: f32,
    edge_angle: f32,
    reflectance: f32,
}

/// Mirror of `Unwrap` in `unwrap_pass.wgsl`.
#[derive(ShaderType, Clone, Copy)]
pub(super) struct UnwrapUniform {
    ball: BallUniform,
    camera_from_world: Mat3,
    focal: Vec2,
    center: Vec2,
    gain: Vec4,
    up_camera: Vec3,
    most_saturation: f32,
    uniform_radiance: Vec3,
    white_from: f32,
    pub history_scale: Vec3,
    pub history_keep: f32,
    lens: Vec4,
    half_fov: f32,
    wrap: f32,
    clipped_from: f32,
    gains_by_direction: f32,
    confidence: f32,
    least_confidence: f32,
    pub share: f32,
    has_solids: f32,
    pub history_is_old: f32,
}

impl UnwrapUniform {
    /// Without history, of full worth.
    pub(super) fn plain(numbers: LensNumbers, camera_from_world: Mat3, gain: Vec3) -> Self {
        Self {
            ball: BallUniform { center_camera: Vec3::NEG_Z, radius: 0.1, edge_angle: 1.0, reflectance: 1.0 },
            camera_from_world,
            focal: numbers.focal,
            center: numbers.center,
            gain: gain.extend(0.0),
            up_camera: Vec3::ZERO,
            most_saturation: MOST_SATURATION,
            uniform_radiance: Vec3::ZERO,
            white_from: WHITE_FROM,
            history_scale: Vec3::ONE,
            history_keep: 1.0,
            lens: numbers.projection,
            half_fov: numbers.half_fov,
            wrap: numbers.wrap,
            clipped_from: clipped_from_linear(),
            gains_by_direction: 0.0,
            confidence: 1.0,
            least_confidence: 0.0,
            share: 1.0,
            has_solids: 0.0,
            history_is_old: 0.0,
        }
    }

    fn of_ball(view: &ProbeView) -> Self {
        let numbers =
            LensNumbers { focal: view.focal, center: view.center, projection: Vec4::X, half_fov: 0.0, wrap: 1.0 };
        let uniform_radiance = view.uniform_radiance.unwrap_or_default();
        Self {
            ball: BallUniform {
                center_camera: view.center_camera,
                radius: view.radius,
                edge_angle: view.edge_angle,
                reflectance: view.reflectance,
            },
            gain: view.gain.extend(if view.uniform_radiance.is_some() { 1.0 } else { 0.0 }),
            up_camera: view.up_camera,
            uniform_radiance,
            ..Self::plain(numbers, view.camera_from_world, Vec3::ONE)
        }
    }
}

/// Which of the shader's variants reads a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum PictureKind {
    Ball,
    Fisheye,
    Equirect,
    SphereMap,
}

impl PictureKind {
    pub(super) const ALL: [Self; 4] = [Self::Ball, Self::Fisheye, Self::Equirect, Self::SphereMap];

    pub(super) fn definition(self) -> Option<&'static str> {
        match self {
            Self::Ball => Some("BALL"),
            Self::Fisheye => Some("FISHEYE"),
            Self::Equirect => Some("EQUIRECT"),
            Self::SphereMap => None,
        }
    }
}

/// What a picture is taken for; compared to see whether it has to be taken again.
#[derive(Clone, PartialEq)]
pub(super) enum SourceView {
    Ball(ProbeView, Option<ClipGains>, Arc<Surroundings>),
    Lens(LensView),
    Fallback(AssetId<Image>, u32, UVec2),
}

/// The pictures that one cube is made from, in the order in which they are merged.
#[derive(Resource, Default)]
pub(super) struct ExtractedSources {
    pub cube: Option<AssetId<Image>>,
    pub sources: Vec<ExtractedSource>,
    /// Share of the way from the fallback to the measured environment that is to be gone now.
    pub share: f32,
}

pub(super) struct ExtractedSource {
    pub entity: Entity,
    pub picture: AssetId<Image>,
    pub sequence: u64,
    pub captured: Duration,
    pub view: SourceView,
    /// What the glance says: factor on what was seen earlier, share by which it has changed.
    pub scale: Vec3,
    pub change: f32,
}

impl ExtractedSource {
    pub(super) fn kind(&self) -> PictureKind {
        match &self.view {
            SourceView::Ball(..) => PictureKind::Ball,
            SourceView::Lens(view) => match view.lens {
                ProbeLens::Fisheye { .. } => PictureKind::Fisheye,
                ProbeLens::Equirect => PictureKind::Equirect,
                ProbeLens::SphereMap { .. } => PictureKind::SphereMap,
            },
            SourceView::Fallback(..) => PictureKind::Equirect,
        }
    }

    pub(super) fn is_fallback(&self) -> bool {
        matches!(self.view, SourceView::Fallback(..))
    }

    pub(super) fn uniform(&self) -> UnwrapUniform {
        match &self.view {
            SourceView::Ball(view, gains, around) => UnwrapUniform {
                gains_by_direction: if gains.is_some() { 1.0 } else { 0.0 },
                has_solids: if around.shown.is_empty() { 0.0 } else { 1.0 },
                history_scale: self.scale,
                ..UnwrapUniform::of_ball(view)
            },
            SourceView::Lens(view) => UnwrapUniform::plain(view.numbers, view.camera_from_world, view.gain),
            SourceView::Fallback(_, _, size) => {
                let numbers = ProbeLens::Equirect.numbers(*size);
                UnwrapUniform {
                    confidence: 0.0,
                    least_confidence: FALLBACK_CONFIDENCE,
                    ..UnwrapUniform::plain(numbers, Mat3::IDENTITY, Vec3::ONE)
                }
            }
        }
    }
}

type SeenBall =
    (Entity, &'static ProbeMeasurement, &'static Glance, &'static EnvironmentCube, Option<&'static ClipGains>);
type SeenPicture = (Entity, &'static LensView, &'static CameraFrame, &'static FrameTexture, &'static EnvironmentCube);

pub(super) fn extract_sources(
    mut extracted: ResMut<ExtractedSources>,
    probes: Extract<Query<SeenBall>>,
    lenses: Extract<Query<SeenPicture>>,
    fallbacks: Extract<Query<(Entity, &FallbackPicture, &EnvironmentCube)>>,
    cameras: Extract<Query<&FrameTexture>>,
) {
    extracted.sources.clear();
    extracted.share = 1.0;
    let mut cube_of_all = None;
    for (entity, fallback, cube) in &fallbacks {
        cube_of_all = Some(cube.0.id());
        extracted.share = fallback.share;
        if fallback.share < 1.0 {
            extracted.sources.push(ExtractedSource {
                entity,
                picture: fallback.image.id(),
                sequence: 0,
                captured: Duration::ZERO,
                view: SourceView::Fallback(fallback.image.id(), fallback.version, fallback.size),
                scale: Vec3::ONE,
                change: 0.0,
            });
        }
    }
    for (entity, measurement, glance, cube, gains) in &probes {
        cube_of_all = Some(cube.0.id());
        let Some(view) = measurement.view else { continue };
        let Ok(frame) = cameras.get(view.camera) else { continue };
        let gains = gains.filter(|gains| gains.0.len() == ClipGains::COUNT).cloned();
        extracted.sources.push(ExtractedSource {
            entity,
            picture: frame.image.id(),
            sequence: measurement.sequence,
            captured: glance.captured,
            view: SourceView::Ball(view, gains, glance.surroundings.clone()),
            scale: glance.scale,
            change: glance.change,
        });
    }
    for (entity, view, frame, texture, cube) in &lenses {
        cube_of_all = Some(cube.0.id());
        extracted.sources.push(ExtractedSource {
            entity,
            picture: texture.image.id(),
            sequence: view.sequence,
            captured: frame.captured,
            view: SourceView::Lens(*view),
            scale: Vec3::ONE,
            change: 0.0,
        });
    }
    extracted.cube = cube_of_all;
}
