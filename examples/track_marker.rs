//! Prints the markers in an image with their corners and poses.
//!
//! ```text
//! cargo run --example track_marker -- --image desk.jpg --intrinsics 602,602,320,240 --json
//! ```

#[path = "support/mod.rs"]
mod support;

use bevy::math::Affine3A;
use bevy_mirrorball::{
    camera::FramePixels,
    prelude::Intrinsics,
    tracking::{AprilTagDetector, DetectedMarker, MarkerFamily, MarkerId, PoseCandidates, detect_markers},
};
use lexopt::prelude::*;
use serde_json::json;
use std::{path::PathBuf, process::ExitCode};
use support::{Outcome, parse_intrinsics, run_with_options};

const USAGE: &str = "track_marker --image FILE --intrinsics FX,FY,CX,CY

  --image FILE              PNG, JPEG, Radiance or OpenEXR
  --intrinsics FX,FY,CX,CY  focal lengths and principal point of the camera, in pixels of the image
  --family NAME             family of the markers [tag36h11]
  --size METERS             side of the black square [0.1]
  --json                    print {\"markers\": [{\"id\", \"corners\", \"camera_from_marker\"}]} instead of text:
                            corners in pixels, from the bottom left of the print counterclockwise; the pose as the
                            columns of a 4 × 4 matrix in meters, camera x right, y up, looking along −z";

struct Options {
    image: PathBuf,
    intrinsics: [f32; 4],
    family: MarkerFamily,
    size: f64,
    is_json: bool,
}

fn options() -> Outcome<Option<Options>> {
    let (mut image, mut intrinsics) = (None, None);
    let (mut family, mut size, mut is_json) = (MarkerFamily::default(), 0.1_f64, false);
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        match argument {
            Long("image") => image = Some(parser.value()?.into()),
            Long("intrinsics") => intrinsics = Some(parse_intrinsics(&parser.value()?.string()?)?),
            Long("family") => family = parser.value()?.parse()?,
            Long("size") => size = parser.value()?.parse()?,
            Long("json") => is_json = true,
            Long("help") | Short('h') => return Ok(None),
            other => return Err(other.unexpected().into()),
        }
    }
    if !(size.is_finite() && size > 0.0) {
        return Err("--size: give a length in meters, above 0".into());
    }
    let image = image.ok_or("--image is missing; see --help")?;
    let intrinsics = intrinsics.ok_or("--intrinsics is missing; see --help")?;
    Ok(Some(Options { image, intrinsics, family, size, is_json }))
}

fn track(options: &Options) -> Outcome<()> {
    let frame = FramePixels::open(&options.image)?;
    let [fx, fy, cx, cy] = options.intrinsics;
    let intrinsics = Intrinsics::new((fx, fy).into(), (cx, cy).into(), frame.size);
    // Whichever markers of the family there are, so that small ones are looked for too.
    let all: Vec<_> = (0..options.family.marker_count()).map(|id| MarkerId::new(options.family, id)).collect();
    let mut detector = AprilTagDetector::with_families(&[options.family])?;
    let mut markers = detect_markers(&mut detector, &frame, &all);
    markers.sort_by_key(|marker| marker.id);
    let posed = |marker: &DetectedMarker| {
        let pose = PoseCandidates::from_corners(&marker.corners, &intrinsics, options.size)?;
        Some((marker.id, marker.corners, Affine3A::from(pose.best.camera_from_marker)))
    };
    let posed: Vec<_> = markers.iter().filter_map(posed).collect();
    if options.is_json {
        let markers = posed.iter().map(|(id, [top_left, top_right, bottom_right, bottom_left], pose)| {
            let corners = [bottom_left, bottom_right, top_right, top_left].map(|corner| corner.to_array());
            let matrix = bevy::math::Mat4::from(*pose).to_cols_array();
            json!({ "id": id, "corners": corners, "camera_from_marker": matrix })
        });
        println!("{}", json!({ "markers": markers.collect::<Vec<_>>() }));
        return Ok(());
    }
    for (id, corners, pose) in &posed {
        let center = corners.iter().sum::<bevy::math::DVec2>() / 4.0;
        println!("{} {id} at {center:.1} px, {:.3} m away", options.family, pose.translation.length());
    }
    if posed.is_empty() {
        println!("no {} marker in {}", options.family, options.image.display());
    }
    Ok(())
}

fn main() -> ExitCode {
    run_with_options("track_marker", USAGE, options(), track)
}
