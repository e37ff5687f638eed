//! Benchmark of the frame time that a shadow dome or planar shadows add, against the shadows of the engine, on the same
//! scene in one process.
//!
//! `cargo bench --profile dev --features egui,webcam --bench shadows -- --csv shadows.csv`
//!
//! It runs in the development profile, so that the build of `cargo test` is reused: all measured work is done by the
//! graphics driver. The columns are
//! `case,directions,casters,triangles,width,height,k,ours_ms,peer,peer_ms,ratio,device,method`.
//!
//! Times are how much longer a frame takes than the same frame without shadows (medians of alternating blocks); ratio =
//! ours ÷ peer. Rows with peer `none` have the times of whole frames instead. A case is `static`, `lights` (the
//! environment and all lights turn in every frame), `moving` (every caster does) or `camera` (the camera moves),
//! followed by the `VisibilitySamples` of a dome; `k` is the number of directions that are redrawn in a moving frame.
//! The method is `dome`, with the name of its filter if that is not its own, `planar` (hard shadows of one light),
//! `soft_planar` or `soft_planar_ambient` (with the rest of the light); those have no directions.
//!
//! `--cases static,moving`, `--triangles 1000,20000,200000`, `--directions 16,64,256` and `--samples interleaved,half`
//! choose the cases, `--methods dome,planar` the methods, `--filters nearest,pcf25` domes with these filters as well,
//! `--casters 20,40` the numbers of things (the triangles are those of the first 20), `--peers directional_2,ssao` the
//! peers, `--size 640x360` the size of the image, `--blocks N` the number of alternations, `--key-lights N` the number
//! of slots for key lights in the dome (2 by default), and `--real-lights N` the number of real lights that take them
//! (none by default, so that all slots stay free), and `--surfels N` the number of surfels that send bounced light (512
//! by default, 0 for none).
//!
//! `--passes` prints the milliseconds of each pass on the GPU as well, in a table of methods and passes. On software
//! Vulkan, the time of a render pass contains that of the draws before it which were not finished.

mod options;
mod stage;
#[path = "../support/mod.rs"]
mod support;

use bevy::math::UVec2;
use options::{Case, Method, Options};
use stage::Stage;
use std::{collections::BTreeMap, fmt::Write};
use support::{Outcome, median, save};

/// Number of frames in a block.
const BLOCK: usize = 3;
/// Number of frames after which the times of passes are those of the case.
const REPORT_DELAY: usize = 6;
/// Number of frames before a block in which casters are still, to redraw the shadow maps that movement has outdated.
const SETTLING: usize = 17;

/// Milliseconds by case, method and label of a pass; the frame as a whole has an empty label.
type Times = BTreeMap<(Case, Method, String), Vec<f64>>;

/// Measures all methods in blocks that alternate.
fn measure(stages: &mut [(Method, Stage)], options: &Options) -> Times {
    let mut times = Times::new();
    for block in 0..2 * options.blocks {
        for &case in &options.cases {
            // In alternating order, so that no method always runs on the warmer machine.
            let order: Vec<usize> =
                if block % 2 == 0 { (0..stages.len()).collect() } else { (0..stages.len()).rev().collect() };
            for i in order {
                let (method, stage) = &mut stages[i];
                if case != Case::Moving && matches!(method, Method::Dome(..)) {
                    (0..SETTLING).for_each(|_| {
                        stage.frame(Case::Static);
                    });
                }
                // The GPU reports the times of passes some frames later.
                (0..if options.passes { REPORT_DELAY } else { 0 }).for_each(|_| {
                    stage.frame(case);
                });
                for _ in 0..BLOCK {
                    let whole = stage.frame(case);
                    times.entry((case, *method, String::new())).or_default().push(whole);
                    for (label, time) in stage.passes() {
                        times.entry((case, *method, label)).or_default().push(time);
                    }
                }
            }
        }
    }
    times
}

fn print_passes(times: &Times) {
    println!("| case | method | pass | ms |\n|---|---|---|---|");
    for ((case, method, label), values) in times {
        let label = if label.is_empty() { "whole frame" } else { label };
        println!("| {} | {} | {label} | {:.2} |", case.name(), method.name(), median(values));
    }
}

/// Header of the table.
const COLUMNS: &str = "case,directions,casters,triangles,width,height,k,ours_ms,peer,peer_ms,ratio,device,method";

fn main() -> Outcome<()> {
    let options = Options::from_command_line()?;
    let mut csv = format!("{COLUMNS}\n");
    for triangles in &options.triangles {
        for casters in &options.casters {
            compare(*triangles, *casters, &options, &mut csv)?;
        }
    }
    save(&csv, options.csv)
}

/// Measures all methods on one scene, and adds the rows.
fn compare(triangles: u32, casters: u32, options: &Options, csv: &mut String) -> Outcome<()> {
    let ours = options.ours();
    let mut stages = Vec::new();
    for method in options.peers.iter().chain(&ours) {
        stages.push((*method, Stage::new(*method, triangles, casters, options)?));
    }
    let times = measure(&mut stages, options);
    if options.passes {
        print_passes(&times);
    }
    let device = stages.first().map_or(String::new(), |(_, stage)| stage.device());
    let triangles = stages.first().map_or(0, |(_, stage)| stage.triangles);
    let time = |case, method| median(&times[&(case, method, String::new())]);
    let UVec2 { x: width, y: height } = options.size;
    for &case in &options.cases {
        let none = time(case, Method::None);
        for &method in &ours {
            let whole = time(case, method);
            let column = method.column();
            let (name, directions, k) = match method {
                Method::Dome(directions, samples, _) => {
                    (format!("{}_{}", case.name(), samples.name()), directions.to_string(), case.refreshed())
                }
                _ => (case.name().to_owned(), String::new(), 0),
            };
            for &peer in &options.peers {
                let (ours, theirs) = match peer {
                    Method::None => (whole, none),
                    peer => (whole - none, time(case, peer) - none),
                };
                let (peer, ratio) = (peer.name(), ours / theirs);
                println!(
                    "{name}, {casters} casters, {triangles} triangles: {column} {directions} {ours:.1} ms, {peer} {theirs:.1} ms, ratio {ratio:.3}"
                );
                writeln!(
                    csv,
                    "{name},{directions},{casters},{triangles},{width},{height},{k},{ours:.3},{peer},{theirs:.3},{ratio:.4},{device},{column}"
                )?;
            }
        }
    }
    Ok(())
}
