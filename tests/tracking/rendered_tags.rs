//! Rendered tags of eight families, of different sizes and tilts, some of them dim or small, are posed as their
//! renderer placed them. The pictures come from `ViSP`, whose axes differ from ours in both the tag and the camera.

use crate::{
    pose_error::{DISTANCE_SHARE, PoseError},
    shared_data,
};
use bevy::{
    math::{DMat4, DQuat, DVec2, DVec3, DVec4},
    prelude::*,
};
use bevy_mirrorball::{
    camera::FramePixels,
    prelude::*,
    tracking::{AprilTagDetector, DetectedMarker, LumaView, MarkerDetector, MarkerFamily, MarkerId, PoseCandidates},
};
use std::{
    f64::consts::{FRAC_PI_2, PI},
    fs,
    path::Path,
};

/// Sides of the whole prints of tags 0…4 in meters. `ViSP` gives the size only in its test program; these and the
/// intrinsics are what maps its poses onto its corners (to 0.14…0.31 px root mean square).
const PRINTS: [f32; 5] = [0.25, 0.25, 0.25, 0.125, 0.125];
/// Errors of poses.
struct Limits {
    /// Rotation. Any confusion of axes is at least 90°.
    degrees: f32,
    /// Translation as a share of the distance for families with a white square, which this renderer widens by about
    /// half a pixel all around.
    white_share: f32,
}

/// Squares 24…65 px wide.
const SMALL_LIMITS: Limits = Limits { degrees: 1.0, white_share: 0.03 };
/// Squares three times as wide.
const LARGE_LIMITS: Limits = Limits { degrees: 0.3, white_share: DISTANCE_SHARE };
/// Distance of corners from where the renderer put them.
const PIXELS: f64 = 0.6;

const INTRINSICS: Intrinsics = Intrinsics::new(Vec2::splat(700.0), Vec2::new(320.0, 240.0), UVec2::new(640, 480));
const LARGE: Intrinsics = Intrinsics::new(Vec2::splat(2100.0), Vec2::new(960.0, 540.0), UVec2::new(1920, 1080));

/// Families and their parts of file names.
pub(crate) const FAMILIES: [(&str, MarkerFamily); 8] = [
    ("36_11", MarkerFamily::Tag36h11),
    ("25_09", MarkerFamily::Tag25h9),
    ("16_05", MarkerFamily::Tag16h5),
    ("21_07", MarkerFamily::TagCircle21h7),
    ("49_12", MarkerFamily::TagCircle49h12),
    ("48_12", MarkerFamily::TagCustom48h12),
    ("41_12", MarkerFamily::TagStandard41h12),
    ("52_13", MarkerFamily::TagStandard52h13),
];

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
fn find(family: MarkerFamily, path: &Path) -> Vec<DetectedMarker> {
    let frame = FramePixels::open(path).expect("a picture");
    let luma = frame.luma8();
    let picture = LumaView::new(frame.size, &luma).expect("as many pixels as the size says");
    let detector = AprilTagDetector::with_families(&[family]);
    let mut found = detector.expect("the AprilTag library of this crate").detect(picture, 2.0);
    found.sort_by_key(|marker| marker.id);
    let markers: Vec<_> = found.iter().map(DetectedMarker::marker).collect();
    assert_eq!(markers, [0, 1, 2, 3, 4].map(|id| MarkerId::new(family, id)), "{}", path.display());
    found
}

#[test]
fn rendered_tags_have_the_poses_of_their_renderer_with_its_axes_turned_to_ours() {
    let Some(folder) = shared_data::find("markers/visp_apriltag/benchmark") else { return };
    for (name, intrinsics, limits) in [("640x480", INTRINSICS, SMALL_LIMITS), ("1920x1080", LARGE, LARGE_LIMITS)] {
        for (short, family) in FAMILIES {
            let found = find(family, &folder.join(name).join(format!("tag{short}_{name}.png")));
            for (id, marker) in found.iter().enumerate() {
                let (rotation, translation) = camera_from_marker(&folder.join("640x480"), id);
                let size = family.size_in_print(PRINTS[id]);
                let candidates =
                    PoseCandidates::from_corners(&marker.corners, &intrinsics, size.into()).expect("a pose");
                let truth = Isometry3d::new(translation.as_vec3(), rotation.as_quat());
                let what = format!("{name} {} (ambiguous: {})", marker.marker(), candidates.is_ambiguous());
                let share = if family.has_border_inside() { limits.white_share } else { DISTANCE_SHARE };
                let pose = candidates.choose(Some(&truth));
                PoseError::of(&pose, &truth).assert_below(&what, limits.degrees, share);
            }
        }
    }
}

#[test]
fn corners_of_rendered_tags_are_where_the_renderer_put_them() {
    let Some(folder) = shared_data::find("markers/visp_apriltag/benchmark/640x480") else { return };
    for (short, family) in FAMILIES {
        let text = read(&folder.join(format!("corners_tag{short}.txt")));
        // Blocks of a number and four corners, which begin at the bottom left and go around the other way.
        let truth = numbers(&text);
        let mut sum = 0.0;
        for (marker, block) in find(family, &folder.join(format!("tag{short}_640x480.png"))).iter().zip(truth.chunks(9))
        {
            assert_eq!(f64::from(marker.id), block[0]);
            for (corner, there) in marker.corners.iter().rev().zip(block[1..].chunks(2)) {
                let off = corner.distance(DVec2::from_slice(there));
                assert!(off < PIXELS, "{}: a corner is off by {off} px", marker.marker());
                sum += off * off / 20.0;
            }
        }
        println!("{family}: {:.2} px root mean square", sum.sqrt());
    }
}
