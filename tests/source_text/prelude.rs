//! What the prelude has to have.

use crate::sources;
use std::path::Path;

/// Names in the code of a source.
fn names(text: &str) -> Vec<&str> {
    let code = text.lines().filter(|line| !line.starts_with("//"));
    code.flat_map(|line| line.split(|c: char| !c.is_alphanumeric() && c != '_')).collect()
}

/// Components of the table in the README.
fn components_of_readme(readme: &str) -> Vec<&str> {
    let rows = readme.lines().skip_while(|line| !line.starts_with("| component |")).skip(2);
    let rows = rows.take_while(|line| line.starts_with('|'));
    rows.filter_map(|row| row.strip_prefix("| `")?.split('`').next()).collect()
}

/// Public types of which the derive or the name says that games read or observe them: events, and components named
/// after a state.
fn states_and_events(text: &str) -> Vec<&str> {
    let mut names = Vec::new();
    // At the start of a line: not those of examples in comments.
    for code in text.split("\n#[derive(").skip(1) {
        let (derives, rest) = code.split_once(")]").expect("a derive ends");
        let item = rest.lines().find(|line| line.starts_with(char::is_alphabetic)).unwrap_or_default();
        let Some(name) = item.split_whitespace().nth(2).map(|name| name.trim_end_matches([';', '{', '('])) else {
            continue;
        };
        let is_state = derives.contains("Component") && (name.ends_with("State") || name.ends_with("Tracking"));
        if item.starts_with("pub ") && (is_state || derives.contains("EntityEvent")) {
            names.push(name);
        }
    }
    names
}

#[test]
fn the_prelude_has_the_components_of_the_readme_and_what_one_reads_back() {
    let read = |file: &str| std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).expect(file);
    let (prelude, readme) = (read("src/prelude.rs"), read("README.md"));
    let prelude = names(&prelude);
    let components = components_of_readme(&readme);
    assert!(components.len() >= 16, "the form of the README's table has changed: {components:?}");
    let sources = sources(&["src"]);
    let states: Vec<&str> = sources.iter().flat_map(|source| states_and_events(&source.text)).collect();
    assert!(states.len() >= 10, "the form of the sources has changed: {states:?}");
    let missing: Vec<_> = components.iter().chain(&states).filter(|name| !prelude.contains(name)).collect();
    assert!(missing.is_empty(), "the prelude lacks {missing:?}");
}

#[test]
fn states_and_events_are_found_in_sources() {
    let text = "/// A.\n#[derive(Component, Clone)]\n#[x]\npub enum AState {\n}\n\n#[derive(EntityEvent)]\npub struct B {\n}\n\n\
                #[derive(Clone)]\npub enum CState {\n}\n\n#[derive(Component)]\npub struct D;\n";
    assert_eq!(states_and_events(text), ["AState", "B"]);
}
