//! What can a thing look like? A teapot, a fox and a block on the recorded desk, in all styles of `SurfaceStyle`.
//!
//! ```text
//! cargo run --example looks --features egui                  # a panel with every parameter; click a thing
//! cargo run --example looks -- --headless --out looks.png    # all looks side by side
//! ```
//! `--help` lists all options.

mod comparison;
mod desk;
mod gallery;
mod look;
mod options;
#[cfg(feature = "egui")]
mod panel;
mod presets;
mod ramps;
mod sheet;
mod styles_file;
#[path = "../support/mod.rs"]
mod support;
#[cfg(feature = "egui")]
mod window;

use options::{Options, USAGE};
use std::process::ExitCode;
use support::{Outcome, has_display, run_with_options};

fn main() -> ExitCode {
    run_with_options("looks", USAGE, Options::from_command_line(), run)
}

fn run(options: &Options) -> Outcome<()> {
    if options.is_headless {
        return gallery::run(options);
    }
    if !has_display() {
        println!("looks: no display, drawing to {}", options.out.display());
        return gallery::run(options);
    }
    open_window(options)
}

#[cfg(feature = "egui")]
fn open_window(options: &Options) -> Outcome<()> {
    window::run(options)
}

#[cfg(not(feature = "egui"))]
fn open_window(_: &Options) -> Outcome<()> {
    Err("this program was built without its panel; build it with `--features egui`, or draw a picture with --headless"
        .into())
}
