//! Photographs and rendered scenes with known truth that are too large, or not free enough, to live in this repository.

use std::path::PathBuf;

/// Path of something in the folder `shared/data` beside the checkout, or `None` with a printed reason where it is
/// missing.
pub(crate) fn find(name: &str) -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(name);
    if path.exists() {
        return Some(path);
    }
    println!("skipped: there is no ../shared/data/{name} beside the checkout");
    None
}
