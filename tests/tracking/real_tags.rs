//! Tags in photographs and renderings: all that are known to be there are read, in all families, and none is invented.

use crate::shared_data;
use bevy_mirrorball::{
    camera::FramePixels,
    tracking::{AprilTagDetector, DetectedMarker, LumaView, MarkerDetector, MarkerFamily, MarkerId, detect_markers},
};
use std::{collections::BTreeSet, fs, path::Path};

/// Numbers of the tag36h11 in photographs of a robot's camera, as a person reads them with the detector's help; the
/// others there are nearly edge-on or smaller than 10 pixels.
const DUCKIETOWN: [(&str, &[u32]); 11] = [
    ("test_image.png", &[60, 82, 318, 328, 387]),
    ("test_image_multiple_01.png", &[22, 24, 58, 85, 144, 198]),
    ("test_image_multiple_02.png", &[22, 24, 85, 144, 198]),
    ("test_image_multiple_03.png", &[22, 24, 58, 85, 144, 198]),
    ("test_image_multiple_04.png", &[22, 24, 58, 85, 144, 198]),
    ("test_image_multiple_05.png", &[22, 24, 85, 198]),
    ("test_image_multiple_06.png", &[22, 24, 58, 85, 144, 198]),
    ("test_image_multiple_07.png", &[22, 24, 58, 85, 144, 198]),
    ("test_image_multiple_08.png", &[85, 144, 198]),
    ("test_image_multiple_09.png", &[22, 24, 58, 85, 144]),
    ("test_image_multiple_10.png", &[24, 58, 85, 198]),
];
/// All numbers on that table.
const TABLE: [u32; 6] = [22, 24, 58, 85, 144, 198];
/// The number in the photographs of one turning tag.
const TURNING: u32 = 76;

/// Markers of all families in an image, at half and at full resolution.
fn read_all(detector: &mut AprilTagDetector, path: &Path) -> BTreeSet<MarkerId> {
    let frame = FramePixels::open(path).expect("a picture");
    let luma = frame.luma8();
    let image = LumaView::new(frame.size, &luma).expect("as many pixels as the size says");
    let read = [2.0, 1.0].map(|decimation| detector.detect(image, decimation));
    read.iter().flatten().map(DetectedMarker::marker).collect()
}

fn pictures(folder: &Path) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("readable").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|kind| kind == "png" || kind == "jpg"));
    paths.sort();
    paths
}

fn all_families() -> AprilTagDetector {
    AprilTagDetector::with_families(&MarkerFamily::ALL).expect("the AprilTag library of this crate")
}

#[test]
fn tags_in_photographs_are_read_by_the_search_of_a_game() {
    let Some(folder) = shared_data::find("markers/duckietown") else { return };
    let mut detector = AprilTagDetector::new().expect("the AprilTag library of this crate");
    let turning = pictures(&folder).into_iter().filter(|path| path.to_string_lossy().contains("rotation"));
    let several = DUCKIETOWN.iter().map(|(name, ids)| (folder.join(name), ids.to_vec()));
    let mut count = 0;
    for (path, ids) in several.chain(turning.map(|path| (path, vec![TURNING]))) {
        let wanted: Vec<MarkerId> = ids.into_iter().map(MarkerId::from).collect();
        let frame = FramePixels::open(&path).expect("a picture");
        let found = detect_markers(&mut detector, &frame, &wanted);
        let found: BTreeSet<_> = found.iter().map(DetectedMarker::marker).collect();
        for marker in &wanted {
            assert!(found.contains(marker), "{}: {marker} is missing", path.display());
        }
        count += wanted.len();
    }
    assert_eq!(count, 71);
}

#[test]
fn no_family_is_invented_in_photographs_of_tag36h11() {
    let Some(folder) = shared_data::find("markers/duckietown") else { return };
    let mut detector = all_families();
    let known: BTreeSet<MarkerId> =
        DUCKIETOWN.iter().flat_map(|(_, ids)| *ids).chain(&TABLE).chain(&[TURNING]).map(|id| (*id).into()).collect();
    for path in pictures(&folder) {
        let read = read_all(&mut detector, &path);
        assert!(read.is_subset(&known), "{}: {read:?}", path.display());
    }
}

#[test]
fn nothing_is_invented_among_markers_of_other_dictionaries() {
    let Some(folder) = shared_data::find("markers/opencv_aruco") else { return };
    let mut detector = all_families();
    let pictures = pictures(&folder);
    assert_eq!(pictures.len(), 12);
    for path in pictures {
        assert_eq!(read_all(&mut detector, &path), BTreeSet::new(), "{}", path.display());
    }
}

#[test]
fn rendered_tags_of_each_family_are_read_as_that_family_only() {
    let Some(folder) = shared_data::find("markers/visp_apriltag/benchmark") else { return };
    let mut detector = all_families();
    for size in ["640x480", "1920x1080"] {
        for (short, family) in crate::rendered_tags::FAMILIES {
            let path = folder.join(size).join(format!("tag{short}_{size}.png"));
            let expected: BTreeSet<_> = (0..5).map(|id| MarkerId::new(family, id)).collect();
            assert_eq!(read_all(&mut detector, &path), expected, "{}", path.display());
        }
    }
}
