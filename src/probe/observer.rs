//! Frames of the AR cameras in which balls are measured.

use super::{
    ball_view::{BallView, EDGE_MARGIN_PIXELS},
    clip_recovery::ClipRecovery,
    clip_task::{ClippedBall, SeenPaper},
    ellipse::Ellipse,
    light_probe_sphere::{LightProbeSphere, UniformSky},
    paper::paper_radiance,
    probe_measurement::{ProbeMeasurement, ProbeView},
};
use crate::{
    camera::{ArCamera, CameraFeed, CameraFrame, FeedPace, Intrinsics, PosedFrame, camera_rank, world_from_camera},
    tracking::SeenMarker,
};
use bevy::{ecs::system::SystemParam, math::Affine3A, prelude::*};

/// Fraction of the box around a ball's outline that must be inside the frame for the ball to be in view.
const MIN_VISIBLE_FRACTION: f32 = 0.33;
/// Fraction of that box from which the gain of clipped light is measured; below it, the last gain is kept.
const MIN_VISIBLE_FRACTION_FOR_GAIN: f32 = 0.9;
/// Radius in the frame from which a ball is usable, in pixels.
const MIN_RADIUS_PIXELS: f32 = 6.0;

type MeasuringCamera = (
    Entity,
    &'static Camera,
    &'static ArCamera,
    &'static CameraFrame,
    &'static GlobalTransform,
    Option<&'static CameraFeed>,
);

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
            .map(|(camera, _, ar_camera, frame, place, feed)| Observer {
                camera,
                is_live: feed.is_some_and(|feed| feed.pace() == FeedPace::Live),
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
    /// Whether frames come when they come, and nothing waits for what is measured in them.
    pub(super) is_live: bool,
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
    /// Measures a ball in the frame. What it shows of clipped light is measured apart, in the second result; until
    /// then it counts as it did in the measurement before.
    pub(super) fn measure(
        &self,
        probe: &LightProbeSphere,
        clip_recovery: &ClipRecovery,
        center_camera: Vec3,
        uniform_sky: Option<&UniformSky>,
        last_gain: Vec3,
    ) -> (ProbeMeasurement, Option<ClippedBall>) {
        let mut measured = ProbeMeasurement { gain: Vec3::ONE, ..default() };
        let PosedFrame { frame, intrinsics, camera_from_world, .. } = self.posed;
        let Some(ball) = BallView::new(center_camera, probe.radius) else {
            return (measured, None);
        };
        measured.outline = ball.outline(&intrinsics);
        measured.is_in_view = is_usable(&ball, &measured.outline, &intrinsics, frame.size);
        if !measured.is_in_view {
            return (measured, None);
        }
        let reflectance = probe.reflectance.clamp(0.01, 1.0);
        measured.paper = self.seen_marker.and_then(|(pose, size)| paper_radiance(frame, &intrinsics, &pose, size));
        let up_camera = self.seen_marker.map(|(pose, _)| pose.transform_vector3(Vec3::Y).normalize());
        let paper = measured.paper.zip(up_camera).filter(|_| clip_recovery.is_enabled);
        if clip_recovery.is_enabled && (paper.is_some() || self.is_posed) {
            // Where something hides the paper, the light has not changed.
            measured.gain = last_gain.max(Vec3::ONE);
        }
        let is_whole = visible_fraction(&measured.outline, frame.size) >= MIN_VISIBLE_FRACTION_FOR_GAIN;
        let seen_paper = |(radiance, normal_camera)| SeenPaper { radiance, normal_camera, recovery: *clip_recovery };
        let clipped_ball = ClippedBall {
            pixels: self.frame.pixels.clone(),
            intrinsics,
            camera_from_world,
            ball,
            outline: measured.outline,
            reflectance,
            paper: paper.filter(|_| is_whole).map(seen_paper),
        };
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
        (measured, Some(clipped_ball))
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
