//! Rendered tags of different sizes and tilts, some of them dim or only 40 pixels wide, are posed as their renderer
//! placed them. The pictures come from `ViSP`, whose axes differ from ours in both the tag and the camera.

use crate::{
    pose_error::{DISTANCE_SHARE, PoseError},
    shared_data,
};
use bevy::{
    math::{DMat4, DQuat, DVec3, DVec4},
    prelude::*,
};
use bevy_mirrorball::{
    camera::FramePixels,
    prelude::*,
    tracking::{AprilTagDetector, DetectedMarker, LumaView, MarkerDetector, PoseCandidates},
};
use std::{
    f64::consts::{FRAC_PI_2, PI},
    fs,
    path::{Path, PathBuf},
};

/// Sides of the black squares of tags 0…4 in meters. `ViSP` gives the size only in its test program; these and the
/// intrinsics are what maps its poses onto its corners (to 0.14…0.31 px root mean square).
const SIZES: [f64; 5] = [0.2, 0.2, 0.2, 0.1, 0.1];
/// Rotation error. Any confusion of axes is at least 90°; the tags are 40…110 px wide.
const DEGREES: f32 = 0.5;

const INTRINSICS: Intrinsics = Intrinsics::new(Vec2::splat(700.0), Vec2::new(320.0, 240.0), UVec2::new(640, 480));

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|number| number.parse().expect("a number")).collect()
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The renderer's pose of a tag, turned to our axes.
///
/// `ViSP`'s tags have x to the right, y to the top edge and z out of the paper: a quarter turn about x from our +Z to
/// the bottom edge and +Y out of the paper. Its camera has y down and z forward: half a turn about x from Bevy's.
fn camera_from_marker(folder: &Path, id: usize) -> (DQuat, DVec3) {
    let rows = numbers(&read(&folder.join(format!("cMo_{id}.txt"))));
    let rows = DMat4::from_cols_slice(&rows).transpose();
    assert!((rows.row(3) - DVec4::W).length() < 1e-9, "a rigid transform");
    let (_, rotation, translation) = rows.to_scale_rotation_translation();
    let camera_from_cv = DQuat::from_rotation_x(PI);
    (camera_from_cv * rotation * DQuat::from_rotation_x(FRAC_PI_2), camera_from_cv * translation)
}

/// Tags as the detector sees them in coded pixels.
///
/// Not by `detect_markers`: this renderer blends edges in coded values, which no lens does. Linear light is the wrong
/// place to look for such edges: `detect_markers` puts the corners 0.7 px too far out here, and the tags 1.6…2.7 % too
/// near.
fn find() -> Option<(PathBuf, Vec<DetectedMarker>)> {
    let folder = shared_data::find("markers/visp_apriltag/benchmark/640x480")?;
    let frame = FramePixels::open(folder.join("tag36_11_640x480.png")).expect("a picture");
    let luma = frame.luma8();
    let picture = LumaView::new(frame.size, &luma).expect("as many pixels as the size says");
    let mut found = AprilTagDetector::new().expect("the AprilTag library of this crate").detect(picture, 2.0);
    found.sort_by_key(|marker| marker.id);
    assert_eq!(found.iter().map(|marker| marker.id).collect::<Vec<_>>(), [0, 1, 2, 3, 4], "markers found");
    Some((folder, found))
}

#[test]
fn rendered_tags_have_the_poses_of_their_renderer_with_its_axes_turned_to_ours() {
    let Some((folder, found)) = find() else { return };
    for (id, marker) in found.iter().enumerate() {
        let (rotation, translation) = camera_from_marker(&folder, id);
        let candidates = PoseCandidates::from_corners(&marker.corners, &INTRINSICS, SIZES[id]).expect("a pose");
        // All tags are seen at a slant, so the corners decide.
        assert!(!candidates.is_ambiguous(), "tag {id} is ambiguous");
        let truth = Isometry3d::new(translation.as_vec3(), rotation.as_quat());
        // The dim tag needs most of the distance's share.
        PoseError::of(&candidates.best, &truth).assert_below(&format!("tag {id}"), DEGREES, DISTANCE_SHARE);
    }
}
