//! Comments of the forms "Mirror of `Name` in `file`" and "Twin of `name`": structs and functions that exist in Rust
//! and in WGSL and have to be changed together.

use crate::{SourceFile, sources};

/// What a comment calls a mirror or twin.
#[derive(Debug, PartialEq)]
enum Original {
    /// An item, and the file in which it is, if the comment says so.
    Item(String, Option<String>),
    /// A whole file.
    File(String),
}

/// Runs of lines that are comments, each with the number of its first line and in one line of text.
fn comments(text: &str) -> Vec<(usize, String)> {
    let mut comments: Vec<(usize, String)> = Vec::new();
    let mut was_comment = false;
    for (i, line) in text.lines().enumerate() {
        // Neither a path of an asset nor an address.
        let start = line.match_indices("//").map(|(at, _)| at).find(|at| !line[..*at].ends_with(':'));
        let Some(start) = start else {
            was_comment = false;
            continue;
        };
        let words = line[start..].trim_start_matches(['/', '!']).trim();
        let is_whole_line = line[..start].trim().is_empty();
        match comments.last_mut() {
            Some((_, comment)) if was_comment && is_whole_line => {
                comment.push(' ');
                comment.push_str(words);
            }
            _ => comments.push((i + 1, words.to_owned())),
        }
        was_comment = is_whole_line;
    }
    comments
}

fn is_source(name: &str) -> bool {
    name.ends_with(".rs") || name.ends_with(".wgsl")
}

/// The first word of a text, without code marks and punctuation, if it is the name of a source file.
fn source_name(text: &str) -> Option<String> {
    let word = text.split_whitespace().next()?.trim_end_matches(['.', ',', ';', ':', ')', '`']).trim_start_matches('`');
    is_source(word).then(|| word.to_owned())
}

/// All originals that a comment names.
fn originals(comment: &str) -> Vec<Original> {
    let lower = comment.to_ascii_lowercase();
    let mut found = Vec::new();
    for form in ["mirror of ", "twin of "] {
        for (at, _) in lower.match_indices(form) {
            let mut rest = &comment[at + form.len()..];
            if let Some(file) = source_name(rest) {
                found.push(Original::File(file));
                continue;
            }
            // One name in code marks, or several.
            let mut names = Vec::new();
            while let Some((name, after)) = rest.strip_prefix('`').and_then(|rest| rest.split_once('`')) {
                names.push(name.to_owned());
                rest = after;
                for link in [", ", " and "] {
                    rest = after.strip_prefix(link).unwrap_or(rest);
                }
            }
            let file = rest.trim_start().strip_prefix("in ").and_then(source_name);
            found.extend(names.into_iter().map(|name| Original::Item(name, file.clone())));
        }
    }
    found
}

/// Whether an item of this name is defined in a source, comments aside. Of a path its last part counts.
fn defines(text: &str, name: &str) -> bool {
    const KEYWORDS: [&str; 9] = ["struct", "enum", "fn", "const", "static", "type", "override", "alias", "trait"];
    let name = name.trim_end_matches("()").rsplit("::").next().unwrap_or(name);
    let is_part_of_name = |c: char| c.is_alphanumeric() || c == '_';
    text.lines().any(|line| {
        let code = line.split("//").next().unwrap_or_default();
        let mut words = code.split(|c| !is_part_of_name(c)).filter(|word| !word.is_empty()).peekable();
        while let Some(word) = words.next() {
            if KEYWORDS.contains(&word) && words.peek() == Some(&name) {
                return true;
            }
        }
        false
    })
}

/// What is wrong with an original, if anything.
fn complaint(original: &Original, sources: &[SourceFile]) -> Option<String> {
    let named = |file: &str| -> Vec<&SourceFile> {
        let is_named = |path: &str| path == file || path.ends_with(&format!("/{file}"));
        sources.iter().filter(|source| is_named(&source.path)).collect()
    };
    match original {
        Original::File(file) => named(file).is_empty().then(|| format!("there is no {file} in src")),
        Original::Item(name, file) => {
            let homes: Vec<&str> =
                sources.iter().filter(|source| defines(&source.text, name)).map(|source| &*source.path).collect();
            if homes.is_empty() {
                return Some(format!("`{name}` is defined nowhere in src; it was renamed or is gone"));
            }
            let file = file.as_ref()?;
            let is_there = named(file).into_iter().any(|source| homes.contains(&&*source.path));
            (!is_there).then(|| format!("`{name}` is not defined in {file}, but in {}", homes.join(", ")))
        }
    }
}

#[test]
fn every_mirror_and_twin_is_where_its_comment_says() {
    let sources = sources(&["src"]);
    let (mut count, mut wrong) = (0, Vec::new());
    for source in &sources {
        for (line, comment) in comments(&source.text) {
            for original in originals(&comment) {
                count += 1;
                let complaint = complaint(&original, &sources);
                wrong.extend(complaint.map(|text| format!("{}:{line}: {text}", source.path)));
            }
        }
    }
    println!("{count} mirrors and twins");
    assert!(count > 0, "the form of these comments has changed, so that none is found");
    assert!(wrong.is_empty(), "{} comments (from these lines on) are wrong:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn names_and_files_are_read_from_comments() {
    let item = |name: &str, file: Option<&str>| Original::Item(name.to_owned(), file.map(str::to_owned));
    assert_eq!(originals("Mirror of `Ball` in `mirror_ball.wgsl`."), [item("Ball", Some("mirror_ball.wgsl"))]);
    assert_eq!(originals("The CPU twin of `sky_cell`, but"), [item("sky_cell", None)]);
    assert_eq!(originals("Mirror of `A` and `B` in a/b.rs."), [item("A", Some("a/b.rs")), item("B", Some("a/b.rs"))]);
    assert_eq!(originals("Twin of solids.rs."), [Original::File("solids.rs".to_owned())]);
    assert_eq!(originals("Mirror of Bevy's `MorphAttributes`, a mirror of the sky."), []);
    let text = "let a = \"embedded://a\"; // Twin of `f`\n/// Mirror of `X`\n/// in `x.rs`.\nstruct X;\n";
    assert_eq!(comments(text), [(1, "Twin of `f`".to_owned()), (2, "Mirror of `X` in `x.rs`.".to_owned())]);
}

#[test]
fn definitions_are_told_from_uses_and_comments() {
    assert!(defines("pub(crate) const fn angle_of(x: f32) -> f32 {", "trigonometry::angle_of"));
    assert!(defines("override TAPS: u32 = 5;", "TAPS"));
    assert!(!defines("// fn angle_of\nlet x = angle_of(1.0); fn angle_of_two() {}", "angle_of"));
}
