//! Frames from files.

use bevy_mirrorball::camera::FramePixels;
use std::path::{Path, PathBuf};

/// Reads image files; a `*` in a name stands for anything, for shells that do not replace it.
pub(crate) fn read(patterns: &[PathBuf]) -> Result<Vec<(PathBuf, FramePixels)>, Box<dyn std::error::Error>> {
    let mut files = Vec::new();
    for pattern in patterns {
        let name = pattern.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        match name.split_once('*') {
            Some((start, end)) => files.extend(matching(pattern, start, end)?),
            None => files.push(pattern.clone()),
        }
    }
    if files.is_empty() {
        return Err("no file matches --images".into());
    }
    files
        .into_iter()
        .map(|path| {
            let frame = FramePixels::open(&path)?;
            Ok((path, frame))
        })
        .collect()
}

/// Files in the folder of a pattern, in the order of their names.
fn matching(pattern: &Path, start: &str, end: &str) -> Result<Vec<PathBuf>, String> {
    let folder = pattern.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).map_err(|error| format!("cannot read {}: {error}", folder.display()))?;
    let is_meant = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        name.len() >= start.len() + end.len() && name.starts_with(start) && name.ends_with(end)
    };
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).filter(is_meant).collect();
    files.sort();
    Ok(files)
}
