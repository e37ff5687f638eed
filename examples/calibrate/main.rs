//! Measures the lens of a camera from views of a printed board, and writes what `dance_stage --calibration` and
//! `Intrinsics::open` read.
//!
//! ```text
//! cargo run --example calibrate -- --board board.svg
//! cargo run --example calibrate -- --images views/*.jpg --out calibration.json
//! cargo run --example calibrate --features webcam -- --device 0 --out calibration.json
//! ```
//! Run with `--help` for all options. Needs no window and no graphics device.

#[cfg(feature = "webcam")]
mod device;
mod images;
mod options;
#[path = "../support/mod.rs"]
mod support;

use bevy_mirrorball::{
    camera::{FramePixels, calibration::Calibration},
    tracking::AprilTagDetector,
};
use options::{Options, Source, USAGE};
use std::process::ExitCode;
use support::{Outcome, run_with_options};

fn main() -> ExitCode {
    run_with_options("calibrate", USAGE, Options::from_command_line(), run)
}

fn run(options: &Options) -> Outcome<()> {
    if let Some(path) = &options.sheet {
        let sheet = options.board.svg()?;
        std::fs::write(path, sheet).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        println!("{}: print it at 100 % and check the scale bar", path.display());
    }
    let Some(source) = &options.source else { return Ok(()) };
    let (names, frames) = views(source, options)?;
    let calibration = options.board.calibrate(&mut AprilTagDetector::new()?, &frames)?;
    report(&names, &calibration);
    calibration.save(&options.out)?;
    println!("written to {}", options.out.display());
    Ok(())
}

/// Frames to calibrate with, and a name of each.
fn views(source: &Source, options: &Options) -> Outcome<(Vec<String>, Vec<FramePixels>)> {
    match source {
        Source::Images(patterns) => {
            let files = images::read(patterns)?;
            Ok(files.into_iter().map(|(path, frame)| (path.display().to_string(), frame)).unzip())
        }
        #[cfg(feature = "webcam")]
        Source::Device(number) => {
            let frames = device::take_views(*number, options)?;
            Ok(((1..=frames.len()).map(|i| format!("view {i}")).collect(), frames))
        }
        #[cfg(not(feature = "webcam"))]
        Source::Device(number) => {
            Err(format!("device {number}, {} views: build with `--features webcam` for webcams", options.views).into())
        }
    }
}

fn report(names: &[String], calibration: &Calibration) {
    let lens = &calibration.intrinsics;
    for (name, error) in names.iter().zip(&calibration.view_errors) {
        match error {
            Some(error) => println!("{name}: {error:.2} px"),
            None => println!("{name}: not used"),
        }
    }
    let [k1, k2, p1, p2, k3] = lens.distortion.coefficients();
    println!(
        "\n{} × {} pixels, {} of {} views usable",
        lens.size.x,
        lens.size.y,
        calibration.used_views(),
        names.len()
    );
    println!(
        "focal lengths      {:.2}, {:.2} px, ± {:.2} %",
        lens.focal.x,
        lens.focal.y,
        100.0 * calibration.focal_uncertainty
    );
    println!("principal point    {:.2}, {:.2} px", lens.center.x, lens.center.y);
    println!("distortion         k1 {k1:.5}, k2 {k2:.5}, p1 {p1:.5}, p2 {p2:.5}, k3 {k3:.5}");
    println!("re-projection      {:.3} px (root mean square)", calibration.reprojection_error);
    println!("the board was seen in {:.0} % of the frame", 100.0 * calibration.coverage);
    for advice in calibration.advice() {
        println!("warning: {advice}");
    }
}
