//! Projection of the game camera from the intrinsics of the real camera.

use super::{ArCamera, CameraFrame, Intrinsics};
use bevy::{
    camera::{CameraProjection, SubCameraView},
    math::Vec3A,
    prelude::*,
};

/// Fit of a camera frame into a view of another size or shape.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum FrameFit {
    /// The frame fills the view; parts that do not fit are cut off evenly on both sides.
    #[default]
    Cover,
    /// The whole frame is visible; bars in the camera's clear color fill the rest.
    Contain,
    /// Width and height are scaled independently.
    Stretch,
}

/// Affine map from frame pixels to view pixels: `view = scale · frame + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameMapping {
    /// View pixels per frame pixel.
    pub scale: Vec2,
    /// Position of the top-left corner of the frame, in view pixels.
    pub offset: Vec2,
    frame_size: Vec2,
    view_size: Vec2,
}

impl FrameMapping {
    /// Map of a frame into a view; both sizes in pixels, above 0. The centers coincide.
    pub fn new(fit: FrameFit, frame_size: Vec2, view_size: Vec2) -> Self {
        let ratio = view_size / frame_size;
        let scale = match fit {
            FrameFit::Cover => Vec2::splat(ratio.max_element()),
            FrameFit::Contain => Vec2::splat(ratio.min_element()),
            FrameFit::Stretch => ratio,
        };
        Self { scale, offset: 0.5 * (view_size - scale * frame_size), frame_size, view_size }
    }

    /// The same map in texture coordinates: `frame_uv = view_uv · xy + zw`.
    pub fn frame_uv_from_view_uv(&self) -> Vec4 {
        let extent = self.scale * self.frame_size;
        let scale = self.view_size / extent;
        let offset = -self.offset / extent;
        Vec4::new(scale.x, scale.y, offset.x, offset.y)
    }

    /// Map from texture coordinates of a camera's viewport to those of its frame: `frame_uv = view_uv · xy + zw`. A
    /// [`SubCameraView`] shows its part of the frame. `None` while the camera has no view.
    pub(crate) fn frame_uv_from_viewport_uv(camera: &Camera, fit: FrameFit, frame_size: UVec2) -> Option<Vec4> {
        let is_some = |size: &UVec2| size.min_element() > 0;
        let view_size = camera.physical_viewport_size().filter(is_some)?;
        let map = |view_size: UVec2| Self::new(fit, frame_size.as_vec2(), view_size.as_vec2()).frame_uv_from_view_uv();
        let Some(sub_view) = &camera.sub_camera_view else {
            return Some(map(view_size));
        };
        let full_size = Some(sub_view.full_size).filter(is_some)?;
        let [scale, offset] = [sub_view.size.as_vec2(), sub_view.offset].map(|part| part / full_size.as_vec2());
        let full = map(full_size);
        let (full_scale, full_offset) = (full.xy(), full.zw());
        let (scale, offset) = (full_scale * scale, full_scale * offset + full_offset);
        Some(Vec4::new(scale.x, scale.y, offset.x, offset.y))
    }

    /// Intrinsics of the view, as if the view were the frame of the camera.
    pub fn view_intrinsics(&self, frame: &Intrinsics) -> Intrinsics {
        Intrinsics::new(frame.focal * self.scale, frame.center * self.scale + self.offset, self.view_size.as_uvec2())
    }
}

/// Off-center perspective projection from pinhole intrinsics, with an infinite far plane and reversed depth.
#[derive(Clone, Debug)]
pub struct IntrinsicsProjection {
    /// Intrinsics of the camera, for its frames.
    pub intrinsics: Intrinsics,
    /// Fit of the frames into the view.
    pub fit: FrameFit,
    /// Distance of the near plane in meters. Defaults to 0.01.
    pub near: f32,
    view_size: Vec2,
}

/// Distance in meters beyond which objects are culled. Depth itself has no far end.
const CULLING_DISTANCE: f32 = 1000.0;

impl IntrinsicsProjection {
    /// Projection for a view of the size of a frame. Bevy then updates it to the real size of the view.
    pub fn new(intrinsics: Intrinsics, fit: FrameFit) -> Self {
        Self { intrinsics, fit, near: 0.01, view_size: intrinsics.size.as_vec2() }
    }

    fn view_intrinsics(&self) -> Intrinsics {
        FrameMapping::new(self.fit, self.intrinsics.size.as_vec2(), self.view_size).view_intrinsics(&self.intrinsics)
    }
}

impl CameraProjection for IntrinsicsProjection {
    fn get_clip_from_view(&self) -> Mat4 {
        let k = self.view_intrinsics();
        let scale = 2.0 * k.focal / self.view_size;
        let shift = 2.0 * k.center / self.view_size - 1.0;
        Mat4::from_cols(
            Vec4::new(scale.x, 0.0, 0.0, 0.0),
            Vec4::new(0.0, scale.y, 0.0, 0.0),
            Vec4::new(-shift.x, shift.y, 0.0, -1.0),
            Vec4::new(0.0, 0.0, self.near, 0.0),
        )
    }

    fn get_clip_from_view_for_sub(&self, sub_view: &SubCameraView) -> Mat4 {
        let full = sub_view.full_size.as_vec2();
        let scale = full / sub_view.size.as_vec2();
        let center = (2.0 * sub_view.offset + sub_view.size.as_vec2()) / full - 1.0;
        let sub_from_full = Mat4::from_translation((Vec2::new(-center.x, center.y) * scale).extend(0.0))
            * Mat4::from_scale(scale.extend(1.0));
        // The frame is fitted into the whole view, whose shape may be another one than that of its part.
        sub_from_full * Self { view_size: full, ..self.clone() }.get_clip_from_view()
    }

    fn update(&mut self, width: f32, height: f32) {
        if width > 0.0 && height > 0.0 {
            self.view_size = Vec2::new(width, height);
        }
    }

    fn far(&self) -> f32 {
        CULLING_DISTANCE
    }

    fn get_frustum_corners(&self, z_near: f32, z_far: f32) -> [Vec3A; 8] {
        let k = self.view_intrinsics();
        let size = self.view_size;
        let corners = [Vec2::new(size.x, size.y), Vec2::new(size.x, 0.0), Vec2::ZERO, Vec2::new(0.0, size.y)];
        std::array::from_fn(|i| {
            let ray = k.ray(corners[i % 4]);
            Vec3A::from(ray * (if i < 4 { z_near } else { z_far } / ray.z))
        })
    }
}

type NewlyFitted = Or<(Changed<ArCamera>, Changed<CameraFrame>)>;

pub(super) fn fit_projections(mut cameras: Query<(&ArCamera, &CameraFrame, &mut Projection), NewlyFitted>) {
    for (camera, frame, mut projection) in &mut cameras {
        let intrinsics = camera.intrinsics_for(frame);
        let current = match &*projection {
            Projection::Custom(custom) => custom.get::<IntrinsicsProjection>(),
            _ => None,
        };
        if current.is_some_and(|p| p.intrinsics == intrinsics && p.fit == camera.fit) {
            continue;
        }
        let mut fitted = IntrinsicsProjection::new(intrinsics, camera.fit);
        if let Some(current) = current {
            (fitted.near, fitted.view_size) = (current.near, current.view_size);
        }
        *projection = Projection::custom(fitted);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::camera::RenderTargetInfo;

    fn webcam() -> Intrinsics {
        Intrinsics::new(Vec2::new(600.0, 590.0), Vec2::new(310.0, 250.0), UVec2::new(640, 480))
    }

    fn view_pixel(projection: &IntrinsicsProjection, pos_camera: Vec3) -> Vec2 {
        let ndc = projection.get_clip_from_view().project_point3(pos_camera);
        Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * projection.view_size
    }

    #[test]
    fn the_projection_agrees_with_the_pinhole_formula() {
        let projection = IntrinsicsProjection::new(webcam(), FrameFit::Cover);
        for pos in [Vec3::new(0.0, 0.0, -1.0), Vec3::new(0.2, -0.1, -0.7), Vec3::new(-0.4, 0.3, -2.0)] {
            let expected = webcam().project(pos).expect("in front");
            assert!(view_pixel(&projection, pos).distance(expected) < 1e-3);
        }
    }

    #[test]
    fn covering_cuts_and_containing_leaves_bars() {
        let (frame, view) = (Vec2::new(640.0, 480.0), Vec2::new(1280.0, 720.0));
        let cover = FrameMapping::new(FrameFit::Cover, frame, view);
        assert_eq!((cover.scale, cover.offset), (Vec2::splat(2.0), Vec2::new(0.0, -120.0)));
        let contain = FrameMapping::new(FrameFit::Contain, frame, view);
        assert_eq!((contain.scale, contain.offset), (Vec2::splat(1.5), Vec2::new(160.0, 0.0)));
        let stretch = FrameMapping::new(FrameFit::Stretch, frame, view);
        assert_eq!(stretch.frame_uv_from_view_uv(), Vec4::new(1.0, 1.0, 0.0, 0.0));
        assert_eq!(contain.frame_uv_from_view_uv(), Vec4::new(1280.0 / 960.0, 1.0, -160.0 / 960.0, 0.0));
    }

    #[test]
    fn a_point_stays_on_its_frame_pixel_in_any_fit() {
        let pos = Vec3::new(0.1, 0.05, -0.8);
        let pixel = webcam().project(pos).expect("in front");
        for fit in [FrameFit::Cover, FrameFit::Contain, FrameFit::Stretch] {
            let mut projection = IntrinsicsProjection::new(webcam(), fit);
            projection.update(1000.0, 300.0);
            let mapping = FrameMapping::new(fit, Vec2::new(640.0, 480.0), Vec2::new(1000.0, 300.0));
            assert!(view_pixel(&projection, pos).distance(pixel * mapping.scale + mapping.offset) < 2e-3);
        }
    }

    #[test]
    fn a_part_of_a_view_shows_its_part_of_the_frame() {
        let frame_size = UVec2::new(640, 480);
        let full_size = UVec2::new(1000, 300);
        let pos = Vec3::new(0.1, 0.05, -0.8);
        let pixel = webcam().project(pos).expect("in front");
        for fit in [FrameFit::Cover, FrameFit::Contain, FrameFit::Stretch] {
            for offset in [Vec2::ZERO, Vec2::new(500.0, 0.0), Vec2::new(250.0, 150.0)] {
                // Half as wide, as high, and shown in a viewport of twice that size.
                let sub_view = SubCameraView { full_size, offset, size: UVec2::new(500, 300) };
                let mut camera = Camera { sub_camera_view: Some(sub_view), ..default() };
                let target = RenderTargetInfo { physical_size: UVec2::new(1000, 600), scale_factor: 1.0 };
                camera.computed.target_info = Some(target);
                let map = FrameMapping::frame_uv_from_viewport_uv(&camera, fit, frame_size).expect("has a view");
                let mut projection = IntrinsicsProjection::new(webcam(), fit);
                projection.update(1000.0, 600.0);
                let ndc = projection.get_clip_from_view_for_sub(&sub_view).project_point3(pos);
                let uv_view = Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y);
                let found = (uv_view * map.xy() + map.zw()) * frame_size.as_vec2();
                assert!(found.distance(pixel) < 1e-2, "{fit:?}, {offset}: {found} instead of {pixel}");
            }
        }
    }

    #[test]
    fn frustum_corners_project_to_the_corners_of_the_view() {
        let projection = IntrinsicsProjection::new(webcam(), FrameFit::Cover);
        let corners = projection.get_frustum_corners(-0.1, -10.0);
        assert!(view_pixel(&projection, corners[0].into()).distance(Vec2::new(640.0, 480.0)) < 1e-2);
        assert!(view_pixel(&projection, corners[6].into()).distance(Vec2::ZERO) < 1e-2);
    }
}
