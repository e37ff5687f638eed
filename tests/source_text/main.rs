//! The text of the sources: comments that name a mirror or a twin, the width of lines, the length of files, what has no
//! place on the web. Does not link the engine.

mod mirrors;
mod prelude;
mod portable;
mod readme;
mod scripts;
mod size;

use std::path::{Path, PathBuf};

/// A source file of this package.
struct SourceFile {
    /// Relative to the package, with `/` between folders.
    path: String,
    text: String,
}

/// All `.rs` and `.wgsl` files in some folders of the package, by path.
fn sources(folders: &[&str]) -> Vec<SourceFile> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for folder in folders {
        collect(&package.join(folder), &mut files);
    }
    let source = |path: PathBuf| SourceFile {
        text: std::fs::read_to_string(&path).expect("sources are text"),
        path: path.strip_prefix(package).expect("found there").to_string_lossy().replace('\\', "/"),
    };
    let mut sources: Vec<SourceFile> = files.into_iter().map(source).collect();
    sources.sort_by(|a, b| a.path.cmp(&b.path));
    assert!(!sources.is_empty(), "there are sources in {folders:?}");
    sources
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder of the package") {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() {
            collect(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs" || extension == "wgsl") {
            files.push(path);
        }
    }
}
