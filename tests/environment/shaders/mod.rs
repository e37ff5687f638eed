//! The shaders of the crate, checked without a GPU.

mod composition;
mod loose_builtins;

use std::path::{Path, PathBuf};

fn shader_files(dir: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(dir).expect("tests run in the package's folder");
    let paths = entries.filter_map(|entry| entry.ok().map(|entry| entry.path()));
    let found = paths.flat_map(|path| match path.extension() {
        _ if path.is_dir() => shader_files(&path),
        Some(extension) if extension == "wgsl" => vec![path],
        _ => vec![],
    });
    found.collect()
}
