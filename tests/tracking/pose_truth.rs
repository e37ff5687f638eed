//! Markers in pictures with known truth: rendered rooms, a recorded clip, a photograph and the sheet this crate prints
//! give the same pose in the same axes.

use crate::pose_error::{DISTANCE_SHARE, PoseError};
use crate::shared_data;
use bevy::{math::DVec2, prelude::*};
use bevy_mirrorball::{
    camera::FramePixels,
    prelude::*,
    tracking::{AprilTagDetector, DetectedMarker, MarkerId, MarkerPose, PoseCandidates, detect_markers},
};
use serde::{Deserialize, de::DeserializeOwned};
use std::{collections::BTreeMap, f32::consts::FRAC_PI_2, fs, path::Path};

/// Rotation against exact truth at 1280 × 720: at 0.7 m an object 0.2 m from the marker is then off by about 1 mm.
const SHARP_DEGREES: f32 = 0.3;
/// Rotation against exact truth in the clip: half the resolution, and JPEG.
const CLIP_DEGREES: f32 = 0.5;
/// Corners against those that came with the photograph, in pixels (measured: 0.75 and 0.6, the others at most 0.4; 0.15
/// outwards in the mean). They
/// were found in gamma-coded pixels, where blurred edges move inwards. Squares fit both alike: to 0.16 px.
const VISP_PIXELS: f64 = 0.9;
/// Rotation against the poses that came with it, which follow from those corners (measured: 0.23°).
const VISP_DEGREES: f32 = 0.5;

fn detector() -> AprilTagDetector {
    AprilTagDetector::new().expect("the AprilTag library of this crate")
}

fn read_json<T: DeserializeOwned>(path: &Path) -> T {
    let text = fs::read_to_string(path).expect("a readable file");
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The only marker in a picture, and its better pose.
fn only_pose(frame: &FramePixels, intrinsics: &Intrinsics, size: f32) -> MarkerPose {
    let markers = detect_markers(&mut detector(), frame, &[0.into()]);
    assert_eq!(markers.iter().map(|marker| marker.id).collect::<Vec<_>>(), [0], "markers found");
    PoseCandidates::from_corners(&markers[0].corners, intrinsics, size.into()).expect("a pose").best
}

#[derive(Deserialize)]
struct Pinhole {
    fx: f32,
    fy: f32,
    cx: f32,
    cy: f32,
}

impl Pinhole {
    fn with_size(&self, size: [u32; 2]) -> Intrinsics {
        Intrinsics::new(Vec2::new(self.fx, self.fy), Vec2::new(self.cx, self.cy), UVec2::from_array(size))
    }
}

#[derive(Deserialize)]
struct PrintedMarker {
    size_m: f32,
}

/// The rendered scenes put y = 0 on the desk; the print lies on a sheet above it.
const PAPER_ABOVE_DESK: Vec3 = Vec3::new(0.0, 0.0006, 0.0);

/// The scenes' truth: a camera that looks from one point of the desk frame to another.
fn truth_looking_at(origin: Vec3, target: Vec3) -> Isometry3d {
    let desk_from_camera = Transform::from_translation(origin).looking_at(target, Vec3::Y).to_isometry();
    desk_from_camera.inverse() * Isometry3d::from_translation(PAPER_ABOVE_DESK)
}

mod rendered_rooms {
    use super::*;

    #[derive(Deserialize)]
    struct Room {
        image: [u32; 2],
        intrinsics: Pinhole,
        camera_to_marker: LookAt,
        marker: PrintedMarker,
    }

    #[derive(Deserialize)]
    struct LookAt {
        origin: Vec3,
        target: Vec3,
        up: Vec3,
    }

    #[test]
    fn a_marker_in_a_rendered_room_gives_the_pose_of_its_camera() {
        let Some(folder) = shared_data::find("ar_truth") else { return };
        for name in ["lebombo", "potsdamer", "studio", "venice", "warehouse"] {
            let room: Room = read_json(&folder.join(format!("open_{name}.json")));
            let frame = FramePixels::open(folder.join(format!("open_{name}_frame.png"))).expect("a picture");
            let view = room.camera_to_marker;
            assert_eq!(view.up, Vec3::Y);
            let pose = only_pose(&frame, &room.intrinsics.with_size(room.image), room.marker.size_m);
            let truth = truth_looking_at(view.origin, view.target);
            PoseError::of(&pose, &truth).assert_below(name, SHARP_DEGREES, DISTANCE_SHARE);
        }
    }
}

mod recorded_clip {
    use super::*;

    #[derive(Deserialize)]
    struct Clip {
        image: [u32; 2],
        intrinsics: Pinhole,
        marker: PrintedMarker,
        frames: Vec<ClipFrame>,
    }

    #[derive(Deserialize)]
    struct ClipFrame {
        k: usize,
        camera_origin: Vec3,
        camera_target: Vec3,
    }

    #[test]
    fn every_tenth_picture_of_the_clip_gives_the_pose_of_its_camera() {
        let folder = Path::new("assets/desk_clip");
        let clip: Clip = read_json(&folder.join("clip.json"));
        let intrinsics = clip.intrinsics.with_size(clip.image);
        for truth in clip.frames.iter().step_by(10) {
            let name = format!("frame_{:03}.jpg", truth.k);
            let frame = FramePixels::open(folder.join(&name)).expect("a picture");
            let pose = only_pose(&frame, &intrinsics, clip.marker.size_m);
            let truth = truth_looking_at(truth.camera_origin, truth.camera_target);
            PoseError::of(&pose, &truth).assert_below(&name, CLIP_DEGREES, DISTANCE_SHARE);
        }
    }
}

mod photograph {
    use super::*;

    /// Side of the black squares in meters.
    const SIZE: f64 = 0.053;

    const INTRINSICS: Intrinsics =
        Intrinsics::new(Vec2::new(615.167_5, 615.167_54), Vec2::new(312.189, 243.437_38), UVec2::new(640, 480));

    /// A binary PGM with 8 bits; comment lines may stand anywhere in its header.
    fn open_pgm(path: &Path) -> FramePixels {
        let bytes = fs::read(path).expect("a readable file");
        let (mut fields, mut at) = (Vec::new(), 0);
        while fields.len() < 4 {
            let rest = &bytes[at..];
            let skip_to = |end: fn(&u8) -> bool| rest.iter().position(end).expect("a complete header");
            if rest[0] == b'#' {
                at += skip_to(|byte| *byte == b'\n');
            } else if rest[0].is_ascii_whitespace() {
                at += 1;
            } else {
                let length = skip_to(u8::is_ascii_whitespace);
                fields.push(String::from_utf8_lossy(&rest[..length]).into_owned());
                at += length;
            }
        }
        assert_eq!((&*fields[0], &*fields[3]), ("P5", "255"));
        let size = UVec2::new(fields[1].parse().expect("a width"), fields[2].parse().expect("a height"));
        // One white-space byte ends the header.
        let rgba = bytes[at + 1..].iter().flat_map(|&gray| [gray, gray, gray, 255]).collect();
        FramePixels::new(size, rgba).expect("as many bytes as the size says")
    }

    /// Lines of numbers below headings such as `36h11_id:_8`.
    fn read_tables(path: &Path) -> BTreeMap<u32, Vec<Vec<f64>>> {
        let mut tables = BTreeMap::<u32, Vec<Vec<f64>>>::new();
        let mut id = 0;
        for line in fs::read_to_string(path).expect("a readable file").lines().map(str::trim) {
            if let Some(number) = line.strip_prefix("36h11_id:_") {
                id = number.parse().expect("a number");
            } else if !line.is_empty() {
                let numbers = line.split_whitespace().map(|number| number.parse().expect("a number"));
                tables.entry(id).or_default().push(numbers.collect());
            }
        }
        tables
    }

    fn find() -> Option<(Vec<DetectedMarker>, BTreeMap<u32, Vec<Vec<f64>>>, BTreeMap<u32, Vec<Vec<f64>>>)> {
        let folder = shared_data::find("markers/visp_apriltag")?;
        let corners = read_tables(&folder.join("ground_truth_detection.txt"));
        let poses = read_tables(&folder.join("ground_truth_pose.txt"));
        assert_eq!((corners.len(), poses.len()), (12, 12));
        let wanted: Vec<MarkerId> = corners.keys().copied().map(MarkerId::from).collect();
        let mut found = detect_markers(&mut detector(), &open_pgm(&folder.join("AprilTag.pgm")), &wanted);
        found.sort_by_key(|marker| marker.id);
        assert_eq!(found.iter().map(DetectedMarker::marker).collect::<Vec<_>>(), wanted, "markers found");
        Some((found, corners, poses))
    }

    #[test]
    fn corners_in_a_photograph_are_where_visp_found_them() {
        let Some((found, corners, _)) = find() else { return };
        for marker in found {
            let expected = corners[&marker.id].iter().map(|row_column| DVec2::new(row_column[1], row_column[0]));
            // ViSP starts at the bottom left and goes around the other way.
            let off = marker.corners.iter().rev().zip(expected).map(|(corner, there)| corner.distance(there));
            let worst = off.fold(0.0, f64::max);
            println!("{}: {worst:.2} px", marker.id);
            assert!(worst < VISP_PIXELS, "tag {}: a corner is off by {worst} px", marker.id);
        }
    }

    #[test]
    fn poses_in_a_photograph_are_those_of_visp_with_its_axes_turned_to_ours() {
        let Some((found, _, poses)) = find() else { return };
        // ViSP's tags have x to the right, y to the top edge and z out of the paper; its camera has y down and z
        // forward.
        let visp_from_marker = Quat::from_rotation_x(FRAC_PI_2);
        let camera_from_cv = Quat::from_rotation_x(std::f32::consts::PI);
        for marker in found {
            let [x, y, z, u, v, w] = <[f64; 6]>::try_from(&*poses[&marker.id][0]).expect("six numbers");
            let (translation, turn) =
                (Vec3::new(x as f32, y as f32, z as f32), Vec3::new(u as f32, v as f32, w as f32));
            let rotation = camera_from_cv * Quat::from_scaled_axis(turn) * visp_from_marker;
            let truth = Isometry3d::new(camera_from_cv * translation, rotation);
            let candidates = PoseCandidates::from_corners(&marker.corners, &INTRINSICS, SIZE).expect("a pose");
            // All tags are seen at a slant, so the corners decide.
            assert!(!candidates.is_ambiguous(), "tag {} is ambiguous", marker.id);
            PoseError::of(&candidates.best, &truth).assert_below(
                &format!("tag {}", marker.id),
                VISP_DEGREES,
                DISTANCE_SHARE,
            );
        }
    }
}
