//! Intrinsics that cannot belong to the frames that arrive.

use super::{ArCamera, CameraFrame, Intrinsics};
use bevy::{platform::collections::HashMap, prelude::*};

/// Distance of the principal point from the middle of the frame, as a fraction of its size, from which it is reported.
/// Lenses and crops of webcams stay below a tenth.
const MAX_OFFSET: f32 = 0.15;
/// Difference of the ratios of width to height of two sizes with the same shape, as a fraction.
const MAX_SHAPE_DIFFERENCE: f32 = 0.02;

/// Reason why intrinsics cannot be right for the frames that arrive.
#[derive(thiserror::Error, Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum IntrinsicsProblem {
    /// A number is not finite, or a length is not above 0. Such intrinsics are not used.
    #[error(
        "the intrinsics cannot be: focal lengths {focal}, principal point {center}, size {size}; all have to be finite, focal \
         lengths and size above 0. A field of view of 60° is assumed",
        focal = .0.focal, center = .0.center, size = .0.size
    )]
    Invalid(Intrinsics),
    /// The principal point is far from the middle of the frame, where lenses have it.
    #[error(
        "the principal point {center} is far from the middle of {} × {} pixels; the intrinsics look like those of {} × {}. Give \
         Intrinsics::size as the size that they were measured at, then they are scaled to the frames",
        .size.x, .size.y, .center.x * 2.0, .center.y * 2.0
    )]
    FarCenter {
        /// Principal point in pixels.
        center: Vec2,
        /// Size that the intrinsics say to be for, in pixels.
        size: UVec2,
    },
    /// The frames have another ratio of width to height: they are a crop that nobody knows. Such intrinsics are not
    /// used.
    #[error(
        "the intrinsics are for {} × {} pixels and the frames have {} × {}, which is another shape; calibrate the camera at the \
         size of the frames, or let it deliver frames of that shape. A field of view of 60° is assumed",
        .size.x, .size.y, .frame.x, .frame.y
    )]
    Shape {
        /// Size that the intrinsics are for, in pixels.
        size: UVec2,
        /// Size of the frames in pixels.
        frame: UVec2,
    },
}

impl Intrinsics {
    /// Returns why these intrinsics cannot be right for frames of a size in pixels: invalid numbers, another shape
    /// than the frames, or a principal point more than 15 % of the size away from the middle. Frames of another size
    /// and the same shape are in order.
    ///
    /// ```
    /// # use bevy::math::{UVec2, Vec2};
    /// # use bevy_mirrorball::camera::{Intrinsics, IntrinsicsProblem};
    /// let (focal, size) = (Vec2::splat(1200.0), UVec2::new(1280, 960));
    /// let known = Intrinsics::new(focal, Vec2::new(640.0, 480.0), size);
    /// assert_eq!(known.problem(UVec2::new(640, 480)), None);
    /// let mixed_up = Intrinsics { size: UVec2::new(640, 480), ..known };
    /// assert!(matches!(mixed_up.problem(UVec2::new(640, 480)), Some(IntrinsicsProblem::FarCenter { .. })));
    /// ```
    pub fn problem(&self, frame: UVec2) -> Option<IntrinsicsProblem> {
        if !self.is_valid() {
            return Some(IntrinsicsProblem::Invalid(*self));
        }
        let size = self.size.as_vec2();
        let shapes = size.x * frame.y as f32 / (size.y * frame.x as f32);
        if (shapes - 1.0).abs() > MAX_SHAPE_DIFFERENCE {
            return Some(IntrinsicsProblem::Shape { size: self.size, frame });
        }
        if (self.center / size - 0.5).abs().max_element() > MAX_OFFSET {
            return Some(IntrinsicsProblem::FarCenter { center: self.center, size: self.size });
        }
        None
    }
}

impl IntrinsicsProblem {
    /// Returns whether the intrinsics are used nevertheless.
    pub(super) fn is_bearable(&self) -> bool {
        matches!(self, Self::FarCenter { .. })
    }
}

/// Warns once when the intrinsics of a camera do not belong to its frames.
pub(super) fn check_intrinsics(
    cameras: Query<(Entity, &ArCamera, &CameraFrame), Or<(Changed<ArCamera>, Changed<CameraFrame>)>>,
    mut reported: Local<HashMap<Entity, IntrinsicsProblem>>,
) {
    for (entity, camera, frame) in &cameras {
        let known = camera.intrinsics.or(frame.intrinsics);
        match known.and_then(|known| known.problem(frame.pixels.size)) {
            // A number that is none differs from itself.
            Some(problem) if reported.get(&entity).is_none_or(|last| last.to_string() != problem.to_string()) => {
                warn!("camera {entity}: {problem}");
                reported.insert(entity, problem);
            }
            Some(_) => {}
            None => {
                reported.remove(&entity);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: UVec2 = UVec2::new(640, 480);

    fn of(center: (f32, f32), size: (u32, u32)) -> Option<IntrinsicsProblem> {
        Intrinsics::new(Vec2::splat(600.0), center.into(), size.into()).problem(FRAME)
    }

    #[test]
    fn usual_cameras_and_other_sizes_of_the_same_shape_are_in_order() {
        for (center, size) in
            [((320.0, 240.0), (640, 480)), ((600.0, 520.0), (1280, 960)), ((165.0, 110.0), (320, 240))]
        {
            assert_eq!(of(center, size), None, "{center:?} of {size:?}");
        }
    }

    #[test]
    fn intrinsics_of_another_size_are_named_with_that_size() {
        for center in [(640.0, 480.0), (160.0, 120.0), (480.0, 360.0)] {
            let text = of(center, (640, 480)).expect("reported").to_string();
            let of_size = format!("those of {} × {}", 2.0 * center.0, 2.0 * center.1);
            assert!(text.contains(&of_size) && text.contains("Intrinsics::size"), "{text}");
        }
    }

    #[test]
    fn another_shape_and_impossible_numbers_are_named() {
        let text = of((640.0, 360.0), (1280, 720)).expect("reported").to_string();
        assert!(text.contains("1280 × 720") && text.contains("640 × 480"), "{text}");
        assert!(of((240.0, 320.0), (480, 640)).is_some(), "turned");
        assert!(matches!(of((f32::NAN, 240.0), (640, 480)), Some(IntrinsicsProblem::Invalid(_))));
    }
}
