//! Radiance of real surfaces in the newest frame.

use crate::camera::{ArCamera, CameraFrame, PosedFrame, camera_rank, world_from_camera};
use bevy::{ecs::system::SystemParam, prelude::*};

/// Minimum cosine between a surface's normal and the direction to the camera.
const MIN_COSINE: f32 = 0.1;

/// The cameras with frames.
#[derive(SystemParam)]
pub(in crate::shadows) struct Frames<'w, 's> {
    cameras:
        Query<'w, 's, (Entity, &'static Camera, &'static ArCamera, &'static CameraFrame, &'static GlobalTransform)>,
}

impl Frames<'_, '_> {
    /// The newest frame of the first camera.
    pub(super) fn newest(&self) -> FrameLight<'_> {
        let first = self.cameras.iter().min_by_key(|(entity, camera, ..)| camera_rank(*entity, camera));
        FrameLight(first.map(|(_, _, camera, frame, place)| {
            let (frame, intrinsics) = (&*frame.pixels, camera.intrinsics_for(frame));
            PosedFrame { frame, intrinsics, camera_from_world: world_from_camera(place).inverse(), exposure: 1.0 }
        }))
    }
}

/// A frame from which radiance is read, if there is any.
pub(super) struct FrameLight<'a>(Option<PosedFrame<'a>>);

impl FrameLight<'_> {
    /// Radiance of a surface in linear camera units; `None` where the frame does not show it. Whether something else is
    /// in front of it is not known.
    pub(super) fn at(&self, pos_world: Vec3, normal: Vec3) -> Option<Vec3> {
        let posed = self.0.as_ref()?;
        let pos_camera = posed.camera_from_world.transform_point3(pos_world);
        let normal_camera = posed.camera_from_world.transform_vector3(normal);
        if normal_camera.dot(-pos_camera.normalize_or_zero()) < MIN_COSINE {
            return None;
        }
        let pixel = posed.project(pos_world)?;
        let is_inside = pixel.cmpge(Vec2::ZERO).all() && pixel.cmplt(posed.frame.size.as_vec2()).all();
        is_inside.then(|| posed.bilinear(pixel).iter().map(|(weight, value)| *weight * *value).sum())
    }
}
