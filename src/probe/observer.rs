//! Frames of the AR cameras in which balls are measured.

use super::{
    ball_view::{BallView, EDGE_MARGIN_PIXELS},
    clip_recovery::{ClipRecovery, PaperAndBall},
    clipping::is_clipped,
    ellipse::Ellipse,
    light_probe_sphere::{LightProbeSphere, UniformSky},
    paper::paper_radiance,
    probe_measurement::{ProbeMeasurement, ProbeView},
};
use crate::{
    camera::{ArCamera, CameraFrame, FramePixels, Intrinsics, PosedFrame, camera_rank, world_from_camera},
    tracking::SeenMarker,
};
use bevy::{ecs::system::SystemParam, math::Affine3A, prelude::*};

/// Fraction of the box around a ball's outline that must be inside the frame for the ball to be in view.
const MIN_VISIBLE_FRACTION: f32 = 0.33;
/// Fraction of that box from which the gain of clipped light is measured; below it, the last gain is kept.
const MIN_VISIBLE_FRACTION_FOR_GAIN: f32 = 0.9;
/// Radius in the frame from which a ball is usable, in pixels.
const MIN_RADIUS_PIXELS: f32 = 6.0;

type MeasuringCamera = (Entity, &'static Camera, &'static ArCamera, &'static CameraFrame, &'static GlobalTransform);

/// The cameras whose frames can show balls, and the markers in them.
#[derive(SystemParam)]
pub(super) struct Observing<'w, 's> {
    cameras: Query<'w, 's, MeasuringCamera>,
    markers: Query<'w, 's, SeenMarker>,
}

impl Observing<'_, '_> {
    /// Newest frame of each camera; those of cameras that have seen a marker first.
    pub(super) fn observers(&self) -> Vec<Observer<'_>> {
        let mut sorted: Vec<_> = self.cameras.iter().collect();
        // A camera that has not seen a marker yet is anywhere.
        let is_posed = |camera| self.markers.iter().any(|marker| marker.is_known_to(camera));
        sorted.sort_by_key(|(entity, camera, ..)| (!is_posed(*entity), camera_rank(*entity, camera)));
        sorted
            .into_iter()
            .map(|(camera, _, ar_camera, frame, place)| Observer {
                camera,
                is_posed: is_posed(camera),
                frame,
                posed: PosedFrame {
                    frame: &frame.pixels,
                    intrinsics: ar_camera.intrinsics_for(frame),
                    camera_from_world: world_from_camera(place).inverse(),
                    exposure: 1.0,
                },
                seen_marker: self.markers.iter().find_map(|marker| marker.paper_in(camera, frame.sequence)),
            })
            .collect()
    }

    pub(super) fn is_marker_changed(&self) -> bool {
        self.markers.iter().any(|marker| marker.is_changed())
    }
}

/// A frame in which balls can be measured, and the marker seen in it: its pose in camera space and its size in meters.
pub(super) struct Observer<'a> {
    pub(super) camera: Entity,
    /// Whether the camera has seen a marker.
    pub(super) is_posed: bool,
    pub(super) frame: &'a CameraFrame,
    pub(super) posed: PosedFrame<'a>,
    seen_marker: Option<(Affine3A, f32)>,
}

/// Chooses the camera that measures a ball: one that has seen a marker and has the ball in view, and of several the
/// one that has measured it so far, so that the light does not change back and forth between two exposures.
pub(super) fn choose_observer<'a>(
    observers: &'a [Observer<'a>],
    last_camera: Option<Entity>,
    center: Vec3,
    radius: f32,
) -> Option<&'a Observer<'a>> {
    let is_in_view = |observer: &Observer| {
        let PosedFrame { frame, intrinsics, camera_from_world, .. } = observer.posed;
        BallView::new(camera_from_world.transform_point3(center), radius)
            .is_some_and(|ball| is_usable(&ball, &ball.outline(&intrinsics), &intrinsics, frame.size))
    };
    observers
        .iter()
        .min_by_key(|observer| (!is_in_view(observer), !observer.is_posed, Some(observer.camera) != last_camera))
}

/// Whether enough of a ball is in a frame, and large enough.
fn is_usable(ball: &BallView, outline: &Ellipse, intrinsics: &Intrinsics, frame_size: UVec2) -> bool {
    ball.radius_pixels(intrinsics) >= MIN_RADIUS_PIXELS && visible_fraction(outline, frame_size) >= MIN_VISIBLE_FRACTION
}

impl Observer<'_> {
    /// Measures a ball in the frame.
    pub(super) fn measure(
        &self,
        probe: &LightProbeSphere,
        clip_recovery: &ClipRecovery,
        center_camera: Vec3,
        uniform_sky: Option<&UniformSky>,
        last_gain: Vec3,
    ) -> ProbeMeasurement {
        let mut measured = ProbeMeasurement { gain: Vec3::ONE, ..default() };
        let PosedFrame { frame, intrinsics, camera_from_world, .. } = self.posed;
        let Some(ball) = BallView::new(center_camera, probe.radius) else {
            return measured;
        };
        measured.outline = ball.outline(&intrinsics);
        let visible = visible_fraction(&measured.outline, frame.size);
        measured.is_in_view = is_usable(&ball, &measured.outline, &intrinsics, frame.size);
        if !measured.is_in_view {
            return measured;
        }
        let reflectance = probe.reflectance.clamp(0.01, 1.0);
        measured.clipped_fraction = clipped_fraction(frame, &measured.outline);
        measured.paper = self.seen_marker.and_then(|(pose, size)| paper_radiance(frame, &intrinsics, &pose, size));
        let up_camera = self.seen_marker.map(|(pose, _)| pose.transform_vector3(Vec3::Y).normalize());
        if let (true, Some(paper), Some(up_camera)) = (clip_recovery.is_enabled, measured.paper, up_camera) {
            let view = PaperAndBall { posed: self.posed, ball: &ball, reflectance, normal_camera: up_camera };
            let is_whole = visible >= MIN_VISIBLE_FRACTION_FOR_GAIN;
            measured.gain = if is_whole { view.gain(paper, clip_recovery) } else { last_gain.max(Vec3::ONE) };
        } else if clip_recovery.is_enabled && self.is_posed {
            // Something hides the paper, which does not change the light.
            measured.gain = last_gain.max(Vec3::ONE);
        }
        let gray = |paper: Vec3| Vec3::splat(paper.element_sum() / (3.0 * clip_recovery.paper_reflectance));
        measured.view = Some(ProbeView {
            camera: self.camera,
            camera_from_world: camera_from_world.matrix3.into(),
            center_camera,
            radius: probe.radius,
            reflectance,
            edge_angle: ball.edge_angle(&intrinsics, EDGE_MARGIN_PIXELS),
            focal: intrinsics.focal,
            center: intrinsics.center,
            gain: measured.gain,
            up_camera: up_camera.unwrap_or_default(),
            uniform_radiance: uniform_sky.map(|sky| sky.radiance.or(measured.paper.map(gray)).unwrap_or(Vec3::ONE)),
        });
        measured
    }
}

/// Fraction of the box around an outline that lies inside a frame.
fn visible_fraction(outline: &Ellipse, frame_size: UVec2) -> f32 {
    let half = outline.half_extent();
    let low = (outline.center - half).max(Vec2::ZERO);
    let high = (outline.center + half).min(frame_size.as_vec2());
    let inside = (high - low).max(Vec2::ZERO);
    inside.element_product() / (4.0 * half.element_product())
}

/// Fraction of the pixels inside an outline that are clipped.
fn clipped_fraction(frame: &FramePixels, outline: &Ellipse) -> f32 {
    let half = outline.half_extent();
    let low = (outline.center - half).max(Vec2::ZERO).as_ivec2();
    let high = (outline.center + half).min(frame.size.as_vec2() - 1.0).as_ivec2();
    let (mut clipped, mut all) = (0u32, 0u32);
    for y in low.y..=high.y {
        for x in low.x..=high.x {
            if outline.contains(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)) {
                all += 1;
                clipped += u32::from(is_clipped(frame, x, y));
            }
        }
    }
    clipped as f32 / all.max(1) as f32
}
