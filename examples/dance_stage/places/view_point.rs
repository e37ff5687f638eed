//! The view of a place: its node `camera_wide`, and the direction of its node `sun`.

use bevy::{camera::PerspectiveProjection, prelude::*};
use gltf::{Gltf, Node, camera::Projection as Lens};
use std::path::{Path, PathBuf};

/// Node with the view, and node that is turned like the sunlight, which shines along its −Z.
const CAMERA: &str = "camera_wide";
const SUN: &str = "sun";
/// Ratio of width to height that a view is made for. Narrower pictures show the same width, wider ones the same height.
const DESIGN_ASPECT: f32 = 4.0 / 3.0;

/// What a scene's file says about view and light. Both nodes are at the root of the scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct ViewPoint {
    pub camera: Transform,
    /// Vertical field of view in radians.
    pub field_of_view: f32,
    /// Rotation of the sunlight.
    pub sun: Quat,
}

/// Error on reading the view of a place.
#[derive(thiserror::Error, Debug)]
pub(crate) enum ViewPointError {
    #[error("cannot read {path}: {reason}; scripts/make_{place}.py writes it")]
    Unreadable { path: PathBuf, place: &'static str, reason: gltf::Error },
    #[error("{path} has no {what} named {name} at the root of its scene; scripts/make_{place}.py writes one")]
    Missing { path: PathBuf, place: &'static str, what: &'static str, name: &'static str },
}

impl ViewPoint {
    /// Reads the file of a scene.
    pub(super) fn open(path: &Path, place: &'static str) -> Result<Self, ViewPointError> {
        let unreadable = |reason| ViewPointError::Unreadable { path: path.to_owned(), place, reason };
        let missing = |what, name| ViewPointError::Missing { path: path.to_owned(), place, what, name };
        let file = Gltf::open(path).map_err(unreadable)?;
        let node = |name| file.scenes().flat_map(|scene| scene.nodes()).find(|node| node.name() == Some(name));
        let lens = |node: &Node| match node.camera()?.projection() {
            Lens::Perspective(lens) => Some(lens.yfov()),
            Lens::Orthographic(_) => None,
        };
        let (camera, field_of_view) = node(CAMERA)
            .and_then(|node| Some((transform(&node), lens(&node)?)))
            .ok_or_else(|| missing("perspective camera", CAMERA))?;
        let sun = node(SUN).ok_or_else(|| missing("node", SUN))?;
        Ok(Self { camera, field_of_view, sun: transform(&sun).rotation })
    }
}

fn transform(node: &Node) -> Transform {
    let (translation, rotation, scale) = node.transform().decomposed();
    Transform {
        translation: Vec3::from_array(translation),
        rotation: Quat::from_array(rotation),
        scale: Vec3::from_array(scale),
    }
}

/// Vertical field of view in radians, of a picture of the design's shape.
#[derive(Component)]
pub(super) struct DesignFieldOfView(pub f32);

/// Fits the field of view to the shape of the picture.
pub(super) fn fit_lenses(mut cameras: Query<(&Camera, &DesignFieldOfView, &mut Projection)>) {
    for (camera, design, mut projection) in &mut cameras {
        let Some(size) = camera.logical_viewport_size().filter(|size| size.min_element() > 0.0) else {
            continue;
        };
        let fov = fitted(design.0, size.x / size.y);
        if let Projection::Perspective(lens) = projection.bypass_change_detection()
            && lens.fov != fov
        {
            let lens = PerspectiveProjection { fov, ..lens.clone() };
            *projection = Projection::Perspective(lens);
        }
    }
}

/// Vertical field of view that shows at least the width of the design.
fn fitted(design: f32, aspect: f32) -> f32 {
    let narrowness = (DESIGN_ASPECT / aspect).max(1.0);
    2.0 * ((0.5 * design).tan() * narrowness).atan()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_pictures_keep_the_height_and_narrow_ones_the_width() {
        assert!((fitted(0.9, 16.0 / 9.0) - 0.9).abs() < 1e-6);
        assert!((fitted(0.9, DESIGN_ASPECT) - 0.9).abs() < 1e-6);
        let width = |fov: f32, aspect: f32| (0.5 * fov).tan() * aspect;
        assert!((width(fitted(0.9, 0.5), 0.5) - width(0.9, DESIGN_ASPECT)).abs() < 1e-6);
    }
}
