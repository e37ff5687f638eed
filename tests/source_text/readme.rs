//! The README: its first program is the example `minimal`, and what it refers to exists.

use std::path::Path;

fn read(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("a text of the package")
}

/// The first block of Rust.
fn first_program(markdown: &str) -> &str {
    let start = markdown.find("```rust").expect("there is a program");
    let body = &markdown[start..];
    let body = &body[body.find('\n').map_or(0, |end| end + 1)..];
    &body[..body.find("```").expect("it ends")]
}

/// An example without its header and without what only examples have.
fn without_support(example: &str) -> String {
    let kept = example.lines().filter(|line| !line.starts_with("//!") && !line.contains("support"));
    kept.collect::<Vec<_>>().join("\n").trim_start().replace("\n\n\n", "\n\n")
}

#[test]
fn the_first_program_is_the_example_minimal() {
    let (readme, minimal) = (read("README.md"), read("examples/minimal.rs"));
    assert_eq!(first_program(&readme).trim(), without_support(&minimal).trim());
    let lines = minimal.lines().count();
    assert!(lines <= 40, "{lines} lines are not minimal");
}

/// Targets of the links and pictures of a text that are files of this package.
fn files(markdown: &str) -> impl Iterator<Item = &str> {
    let targets = markdown.match_indices("](").map(|(at, _)| &markdown[at + 2..]);
    let targets = targets.filter_map(|rest| rest.split([')', ' ']).next());
    targets.filter(|target| !target.contains("://") && !target.starts_with('#'))
}

#[test]
fn every_file_that_a_page_refers_to_exists() {
    for (page, folder) in [("README.md", ""), ("CONTRIBUTING.md", ""), ("docs/MEASUREMENTS.md", "docs/")] {
        for file in files(&read(page)) {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder).join(file);
            assert!(path.exists(), "{page} refers to {file}");
        }
    }
}

#[test]
fn every_example_is_in_the_readme() {
    let readme = read("README.md");
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    for entry in std::fs::read_dir(folder).expect("there are examples") {
        let path = entry.expect("readable").path();
        let name = path.file_stem().expect("it has a name").to_string_lossy();
        assert!(name == "support" || readme.contains(&format!("--example {name}")), "{name} is not in the README");
    }
}

#[test]
fn links_are_found() {
    let text = "[a](docs/A.md) ![b](b.jpg \"title\") [c](https://c.org) [d](#d)";
    assert_eq!(files(text).collect::<Vec<_>>(), ["docs/A.md", "b.jpg"]);
    assert_eq!(first_program("a\n```rust,no_run\nfn main() {}\n```\n"), "fn main() {}\n");
}
