//! Benchmark of marker detection against the AprilTag library's plain search of the whole frame, on the same frames in
//! one process and on one core.
//!
//! `cargo bench --bench tracking -- --csv tracking.csv`
//!
//! The columns are `case,width,height,ours_ms,library_ms,ratio`: medians over a sequence of rendered frames in which a
//! marker moves over a cluttered desk, and ratio = ours ÷ library. The library searches at half resolution, its
//! default. `search` is a frame without a past, `track` each next frame of the sequence.
//!
//! `--frames N` measures that many frames.

#[path = "../tests/support/rendered_marker.rs"]
mod rendered_marker;

use bevy::prelude::*;
use bevy_mirrorball::{
    camera::FramePixels,
    prelude::Intrinsics,
    tracking::{AprilTagDetector, LumaView, MarkerDetector, MarkerId, MarkerTracker},
};
use rendered_marker::MarkerDesk;
use std::{fmt::Write, path::PathBuf, time::Instant};

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Sizes of the frames, with the focal lengths of usual webcams in pixels.
const CAMERAS: [(UVec2, f32); 2] = [(UVec2::new(640, 480), 600.0), (UVec2::new(1280, 720), 1100.0)];
/// Side of the marker and its distance, in meters: 100 and 183 pixels.
const MARKER: f32 = 0.1;
const DISTANCE: f32 = 0.6;

struct Options {
    csv: Option<PathBuf>,
    frames: usize,
}

impl Options {
    fn from_command_line() -> Outcome<Self> {
        use lexopt::prelude::*;
        let mut options = Self { csv: None, frames: 60 };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("csv") => options.csv = Some(parser.value()?.into()),
                Long("frames") => options.frames = parser.value()?.parse::<usize>()?.max(3),
                // Cargo passes this to every benchmark.
                Long("bench") => (),
                other => return Err(other.unexpected().into()),
            }
        }
        Ok(options)
    }
}

/// Pose of the marker: a camera that circles by 2° per frame, which moves the marker by a few pixels.
fn pose(frame: usize) -> Isometry3d {
    let angle = (2.0 * frame as f32).to_radians();
    let eye = Vec3::new(0.3 * angle.sin(), 0.8, 0.3 * angle.cos()).normalize() * DISTANCE;
    let target = Vec3::new(0.05 * (2.0 * angle).sin(), 0.0, 0.03);
    Transform::from_translation(eye).looking_at(target, Vec3::NEG_Z).to_isometry().inverse()
}

/// Milliseconds that a call takes.
fn timed<T>(call: impl FnOnce() -> T) -> (f64, T) {
    let started = Instant::now();
    let result = call();
    (started.elapsed().as_secs_f64() * 1000.0, result)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() -> Outcome<()> {
    let options = Options::from_command_line()?;
    let mut detector = AprilTagDetector::new()?;
    let wanted = [MarkerId::from(0)];
    let mut csv = String::from("case,width,height,ours_ms,library_ms,ratio\n");
    for (size, focal) in CAMERAS {
        let intrinsics = Intrinsics::new(Vec2::splat(focal), 0.5 * size.as_vec2(), size);
        let cells = detector.cells(0).ok_or("tag36h11 has a number 0")?;
        let desk = MarkerDesk::new(intrinsics, cells, MARKER);
        let frames: Vec<FramePixels> = (0..options.frames).map(|i| desk.frame(pose(i), i as u64)).collect();
        let mut tracker = MarkerTracker::default();
        let [mut search, mut track, mut library] = [const { Vec::new() }; 3];
        for (i, frame) in frames.iter().enumerate() {
            let (milliseconds, plain) = timed(|| {
                let luma = frame.luma8();
                LumaView::new(frame.size, &luma).map_or(0, |luma| detector.detect(luma, 2.0).len())
            });
            library.push(milliseconds);
            let (milliseconds, searched) = timed(|| MarkerTracker::default().detect(&mut detector, frame, &wanted));
            search.push(milliseconds);
            let (milliseconds, tracked) = timed(|| tracker.detect(&mut detector, frame, &wanted));
            // The first frame is a search.
            if i > 0 {
                track.push(milliseconds);
            }
            if [plain, searched.len(), tracked.len()] != [1; 3] {
                return Err(format!("frame {i} of {size}: the marker was not found by all").into());
            }
        }
        let library = median(library);
        for (case, ours) in [("search", median(search)), ("track", median(track))] {
            writeln!(csv, "{case},{},{},{ours:.3},{library:.3},{:.3}", size.x, size.y, ours / library)?;
        }
    }
    print!("{csv}");
    if let Some(path) = options.csv {
        std::fs::write(path, csv)?;
    }
    Ok(())
}
