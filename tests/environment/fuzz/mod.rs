//! Damaged files of every kind that the crate reads: no panic, no hang, little memory.
//!
//! Small good files are mutated and read for a second each. `MIRRORBALL_FUZZ_SECONDS=300` makes that longer and starts
//! from the clock; `MIRRORBALL_FUZZ_SEED` repeats a run. The input that failed stays in the target folder, and its
//! message says where.

mod corpus;
mod cases;
mod memory;
mod mutate;

use bevy_mirrorball::{
    authoring::read_scene_components, camera::Clip, camera::FramePixels, environment_map::EquirectPixels,
    shadows::LightsFile,
};
use mutate::{Random, mutated};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
    sync::mpsc::{RecvTimeoutError, channel},
    time::{Duration, Instant},
};

/// Memory that reading one small damaged file may take.
const MAX_BYTES: usize = 300 << 20;
/// A reader that takes longer than this for a file of a few kilobytes hangs, also on a machine that is busy.
const HANGING: Duration = Duration::from_secs(60);

/// A folder for the inputs of one kind.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz").join(name);
    std::fs::create_dir_all(&folder).expect("the target folder is writable");
    folder
}

fn setting(name: &str) -> Option<u64> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name} is {text:?} and has to be a whole number")))
}

/// Reads one file; the results do not matter.
type Reader = fn(&Path);

/// Reads mutated files of a kind in a thread of its own until the time is over.
fn fuzz(kind: &'static str, corpus: Vec<(&'static str, Vec<u8>)>, dictionary: &'static [&'static str], read: Reader) {
    let seconds = setting("MIRRORBALL_FUZZ_SECONDS");
    let clock = || std::time::UNIX_EPOCH.elapsed().map_or(1, |time| time.as_nanos() as u64);
    let seed = setting("MIRRORBALL_FUZZ_SEED").unwrap_or_else(|| if seconds.is_some() { clock() } else { 1 });
    println!("{kind}: MIRRORBALL_FUZZ_SEED={seed}");
    let folder = folder(kind);
    let end = Instant::now() + Duration::from_secs(seconds.unwrap_or(1));
    let (progress, steps) = channel();
    std::thread::spawn(move || {
        let mut random = Random(seed);
        let mut most = 0;
        for count in 1_u64.. {
            let input = &corpus[random.below(corpus.len())];
            // The first files are the good ones, so that the memory of these counts too.
            let bytes = match corpus.get(count as usize - 1) {
                Some(good) => good.1.clone(),
                None => mutated(&input.1, &corpus, dictionary, &mut random),
            };
            let name = if (count as usize) <= corpus.len() { corpus[count as usize - 1].0 } else { input.0 };
            let path = folder.join(name);
            std::fs::write(&path, bytes).expect("the target folder is writable");
            memory::start();
            let outcome = catch_unwind(AssertUnwindSafe(|| read(&path)));
            let peak = memory::peak();
            most = most.max(peak);
            let problem = match outcome {
                Err(_) => Some("panicked".to_owned()),
                Ok(()) if peak > MAX_BYTES => Some(format!("took {} MB", peak >> 20)),
                Ok(()) => None,
            };
            let is_last = problem.is_some() || Instant::now() > end;
            if progress.send((count, most, is_last, problem.map(|problem| (problem, path)))).is_err() || is_last {
                return;
            }
        }
    });
    loop {
        match steps.recv_timeout(HANGING) {
            Ok((count, _, _, Some((problem, path)))) => {
                panic!("{kind}: input {count} of seed {seed} {problem}; it is {}", path.display())
            }
            Ok((count, most, true, None)) => {
                println!("{kind}: seed {seed}, {count} inputs, {:.1} MB at most", most as f64 / 1e6);
                return;
            }
            Ok(_) => {}
            Err(RecvTimeoutError::Timeout) => panic!("{kind}: seed {seed} hangs; the input is the newest file there"),
            Err(RecvTimeoutError::Disconnected) => panic!("{kind}: the reader of seed {seed} is gone"),
        }
    }
}

pub(super) fn read_environment(path: &Path) {
    if let Ok(image) = EquirectPixels::open(path) {
        assert!(image.texels.iter().all(|texel| texel.is_finite() && texel.min_element() >= 0.0));
    }
    let _ = bevy_mirrorball::probe::open_photo(path);
    let _ = FramePixels::open(path);
}

pub(super) fn read_scene(path: &Path) {
    let _ = read_scene_components(path).map_err(|error| error.to_string());
}

pub(super) fn read_sidecar(path: &Path) {
    let folder = path.parent().expect("a file in a folder");
    if let Ok(clip) = Clip::open(folder) {
        assert_eq!(clip.files.len(), clip.exposures.len());
        assert!(clip.intrinsics.is_none_or(|intrinsics| intrinsics.is_valid()));
        let _ = clip.intrinsics.and_then(|intrinsics| intrinsics.problem(clip.size)).map(|problem| problem.to_string());
    }
}

pub(super) fn read_lights(path: &Path) {
    let text = String::from_utf8_lossy(&std::fs::read(path).expect("written")).into_owned();
    let _ = LightsFile::parse(&text).map_err(|error| error.to_string());
}

pub(super) fn read_frame(path: &Path) {
    if let Ok(frame) = FramePixels::open(path) {
        assert_eq!(frame.rgba.len() as u64, 4 * u64::from(frame.size.x) * u64::from(frame.size.y));
    }
}

#[test]
fn damaged_environments() {
    fuzz("environments", corpus::environments(), mutate::IMAGE_WORDS, read_environment);
}

#[test]
fn damaged_scenes() {
    fuzz("scenes", corpus::scenes(), mutate::JSON_WORDS, read_scene);
}

#[test]
fn damaged_sidecars() {
    std::fs::write(folder("sidecars").join("frame_1.jpg"), b"not read").expect("the target folder is writable");
    fuzz("sidecars", corpus::sidecars(), mutate::JSON_WORDS, read_sidecar);
}

#[test]
fn damaged_lights_files() {
    fuzz("lights", corpus::lights(), mutate::RON_WORDS, read_lights);
}

#[test]
fn damaged_jpegs() {
    fuzz("jpegs", corpus::jpegs(), &[], read_frame);
}
