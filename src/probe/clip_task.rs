//! Measurement of what the camera clipped of a ball: takes milliseconds, so it runs in the background where frames
//! follow one another.

use super::{
    ball_view::BallView,
    clip_recovery::{ClipRecovery, PaperAndBall},
    clipping::is_clipped,
    ellipse::Ellipse,
    probe_measurement::ProbeMeasurement,
};
use crate::{
    camera::{FramePixels, Intrinsics, PosedFrame},
    frame_tasks::spawn_for_frame,
};
use bevy::{
    math::Affine3A,
    platform::time::Instant,
    prelude::*,
    tasks::{Task, futures::check_ready},
};
use std::{sync::Arc, time::Duration};

/// A ball in a frame, with all that its clipped light depends on.
pub(super) struct ClippedBall {
    pub(super) pixels: Arc<FramePixels>,
    pub(super) intrinsics: Intrinsics,
    pub(super) camera_from_world: Affine3A,
    pub(super) ball: BallView,
    pub(super) outline: Ellipse,
    pub(super) reflectance: f32,
    /// Paper from which the gain follows; without it only clipped pixels are counted.
    pub(super) paper: Option<SeenPaper>,
}

/// Marker's paper in a frame.
pub(super) struct SeenPaper {
    pub(super) radiance: Vec3,
    /// Camera space.
    pub(super) normal_camera: Vec3,
    pub(super) recovery: ClipRecovery,
}

/// Result of measuring a [`ClippedBall`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Clipping {
    fraction: f32,
    gain: Option<Vec3>,
    cpu_time: Duration,
}

impl ClippedBall {
    pub(super) fn measure(&self) -> Clipping {
        let started = Instant::now();
        let fraction = clipped_fraction(&self.pixels, &self.outline);
        let posed = PosedFrame {
            frame: &self.pixels,
            intrinsics: self.intrinsics,
            camera_from_world: self.camera_from_world,
            exposure: 1.0,
        };
        let gain = self.paper.as_ref().map(|SeenPaper { radiance, normal_camera, recovery }| {
            let view =
                PaperAndBall { posed, ball: &self.ball, reflectance: self.reflectance, normal_camera: *normal_camera };
            view.gain(*radiance, recovery)
        });
        Clipping { fraction, gain, cpu_time: started.elapsed() }
    }
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

impl ProbeMeasurement {
    /// Takes over what was measured of the clipped light.
    pub(super) fn set_clipping(&mut self, clipping: &Clipping) {
        self.clipped_fraction = clipping.fraction;
        if let Some(gain) = clipping.gain {
            self.gain = gain;
            if let Some(view) = &mut self.view {
                view.gain = gain;
            }
        }
    }
}

/// Measurement in the background, on the entity of a ball. One frame is measured at a time; of those that arrive
/// meanwhile, the newest waits.
#[derive(Component, Default)]
pub(crate) struct ClipTask {
    running: Option<Task<Clipping>>,
    waiting: Option<ClippedBall>,
    /// CPU time of the newest result.
    pub(super) cpu_time: Duration,
}

impl ClipTask {
    /// Measures a ball at once. What was to be measured before is dropped.
    pub(super) fn measure_now(&mut self, ball: Option<&ClippedBall>) -> Option<Clipping> {
        (self.running, self.waiting) = (None, None);
        let clipping = ball.map(ClippedBall::measure);
        self.cpu_time = clipping.map_or(Duration::ZERO, |clipping| clipping.cpu_time);
        clipping
    }

    /// Measures a ball as soon as the one before is done.
    pub(super) fn measure_soon(&mut self, ball: ClippedBall) {
        self.waiting = Some(ball);
        self.start_waiting();
    }

    /// The result, once it is there.
    pub(super) fn finished(&mut self) -> Option<Clipping> {
        let clipping = check_ready(self.running.as_mut()?)?;
        self.running = None;
        self.cpu_time = clipping.cpu_time;
        self.start_waiting();
        Some(clipping)
    }

    fn start_waiting(&mut self) {
        if self.running.is_none()
            && let Some(ball) = self.waiting.take()
        {
            self.running = Some(spawn_for_frame(async move { ball.measure() }));
        }
    }
}
