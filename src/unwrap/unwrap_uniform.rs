//! Uniform of the unwrap pass.

use crate::probe::{LensNumbers, MAX_SATURATION, ProbeView, WHITE_FROM, clipped_from_linear};
use bevy::{prelude::*, render::render_resource::ShaderType};

/// Mirror of `Ball` in `ball_view.wgsl`.
#[derive(ShaderType, Clone, Copy)]
struct BallUniform {
    center_camera: Vec3,
    radius: f32,
    edge_angle: f32,
    reflectance: f32,
}

/// Mirror of `Unwrap` in `bindings.wgsl`.
#[derive(ShaderType, Clone, Copy)]
pub(super) struct UnwrapUniform {
    ball: BallUniform,
    camera_from_world: Mat3,
    focal: Vec2,
    center: Vec2,
    gain: Vec4,
    up_camera: Vec3,
    max_saturation: f32,
    uniform_radiance: Vec3,
    white_from: f32,
    pub(super) history_scale: Vec3,
    pub(super) history_keep: f32,
    lens: Vec4,
    half_fov: f32,
    wrap: f32,
    clipped_from: f32,
    pub(super) gains_by_direction: f32,
    pub(super) confidence: f32,
    pub(super) min_confidence: f32,
    pub(super) weight: f32,
    pub(super) has_solids: f32,
    pub(super) history_is_old: f32,
}

impl UnwrapUniform {
    /// Uniform of a lens, without history and at full confidence.
    pub(super) fn of_lens(numbers: LensNumbers, camera_from_world: Mat3, gain: Vec3) -> Self {
        Self {
            ball: BallUniform { center_camera: Vec3::NEG_Z, radius: 0.1, edge_angle: 1.0, reflectance: 1.0 },
            camera_from_world,
            focal: numbers.focal,
            center: numbers.center,
            gain: gain.extend(0.0),
            up_camera: Vec3::ZERO,
            max_saturation: MAX_SATURATION,
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
            min_confidence: 0.0,
            weight: 1.0,
            has_solids: 0.0,
            history_is_old: 0.0,
        }
    }

    /// Uniform of a ball, without history and at full confidence.
    pub(super) fn of_ball(view: &ProbeView) -> Self {
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
            ..Self::of_lens(numbers, view.camera_from_world, Vec3::ONE)
        }
    }
}
