//! What light from object to object and the camera's grain add to the time of a frame of the dance stage.
//!
//! `cargo bench --profile dev --features egui,webcam --bench effects -- --csv effects.csv`
//!
//! It runs in the development profile, so that the build of `cargo test` is reused: nearly all measured work is done by
//! the graphics driver. The columns are `case,effect,width,height,ms,base_ms,added,device`: `ms` is the median time of
//! a frame with an effect, `base_ms` that of a frame without any, in blocks that alternate in one process, and `added`
//! is `ms` ÷ `base_ms` − 1. The effects are `bounce` ([`ShadowDomeLight::surfels`]), `neighbors`
//! ([`NeighborReflections`]), `grain` ([`CameraGrain`]) and `all` of them.
//!
//! In the case `still` one frame of the recorded desk is shown and nothing moves, in `dance` the dancer does, and in
//! `live` the recording goes on as well, with its marker, ball and lights measured anew in every frame.
//!
//! `--cases still,dance` and `--effects bounce,all` choose some, `--blocks N` is the number of blocks for each.

mod desk;
mod dancer;
#[path = "../../examples/dance_stage/stage.rs"]
#[expect(dead_code, reason = "the example needs more of it")]
mod stage;
#[path = "../support/mod.rs"]
mod support;

use desk::{Case, Desk, Effect, SIZE};
use std::{fmt::Write, path::PathBuf};
use support::{Outcome, alternate, device_name, frame_time, median, save};

/// Number of frames in a block.
const BLOCK: usize = 4;

struct Options {
    csv: Option<PathBuf>,
    cases: Vec<Case>,
    effects: Vec<Effect>,
    blocks: usize,
}

impl Options {
    fn from_command_line() -> Outcome<Self> {
        use lexopt::prelude::*;
        let mut options = Self { csv: None, cases: Case::ALL.into(), effects: Effect::ALL.into(), blocks: 8 };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("csv") => options.csv = Some(parser.value()?.into()),
                Long("cases") => options.cases = chosen("--cases", &Case::ALL, Case::name, &parser.value()?.string()?)?,
                Long("effects") => {
                    options.effects = chosen("--effects", &Effect::ALL, Effect::name, &parser.value()?.string()?)?;
                }
                Long("blocks") => options.blocks = parser.value()?.parse::<usize>()?.max(1),
                // Cargo passes this to every benchmark.
                Long("bench") => (),
                other => return Err(other.unexpected().into()),
            }
        }
        Ok(options)
    }
}

/// Returns those of a list whose names are in a list with commas.
fn chosen<T: Copy>(option: &str, all: &[T], name_of: fn(T) -> &'static str, names: &str) -> Outcome<Vec<T>> {
    names
        .split(',')
        .map(|name| {
            let known = || all.iter().map(|&one| name_of(one)).collect::<Vec<_>>().join(", ");
            let found = all.iter().copied().find(|&one| name_of(one) == name);
            found.ok_or_else(|| format!("{option}: {name} is none of {}", known()).into())
        })
        .collect()
}

fn main() -> Outcome<()> {
    let options = Options::from_command_line()?;
    let mut csv = "case,effect,width,height,ms,base_ms,added,device\n".to_owned();
    for &case in &options.cases {
        let effects = std::iter::once(None).chain(options.effects.iter().copied().map(Some));
        let mut desks =
            effects.map(|effect| Ok((effect, Desk::new(case, effect)?, Vec::new()))).collect::<Outcome<Vec<_>>>()?;
        alternate(&mut desks, options.blocks, |(_, desk, times)| {
            for _ in 0..BLOCK {
                times.push(frame_time(&mut desk.app)?);
            }
            Ok(())
        })?;
        let mut base = f64::NAN;
        for (effect, desk, times) in &desks {
            let ms = median(times);
            let Some(effect) = effect else {
                base = ms;
                continue;
            };
            let (case, effect, added) = (case.name(), effect.name(), ms / base - 1.0);
            println!("{case}, {effect}: {ms:.1} ms, {base:.1} ms without, {added:+.3}");
            writeln!(
                csv,
                "{case},{effect},{},{},{ms:.3},{base:.3},{added:.4},{}",
                SIZE.x,
                SIZE.y,
                device_name(&desk.app)
            )?;
        }
    }
    save(&csv, options.csv)
}
