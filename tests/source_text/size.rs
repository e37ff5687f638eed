//! Lines and files that are too long to read.

use crate::sources;

/// Columns of a line, as `rustfmt.toml` has it. Comments and shaders, which `rustfmt` leaves alone, are wrapped by
/// hand. Messages stay in one piece, so that a search finds them, and so do rows of tables: neither counts.
const MAX_COLUMNS: usize = 120;
/// Lines of a file.
const MAX_LINES: usize = 300;
/// Fraction of unit tests above which a file may be longer.
const TEST_FRACTION: f64 = 0.25;

/// Columns that are left of a line without its string literals; none of a row of a table.
fn columns_without_text(line: &str) -> usize {
    if line.trim_start().starts_with("//! |") || line.trim_start().starts_with("/// |") {
        return 0;
    }
    let (mut columns, mut is_text, mut is_escaped) = (0, false, false);
    for letter in line.chars() {
        columns += usize::from(!is_text);
        is_text ^= letter == '"' && !is_escaped;
        is_escaped = letter == '\\' && !is_escaped;
    }
    columns
}

#[test]
fn text_does_not_count_as_columns() {
    assert_eq!(columns_without_text(r#"f("ab\"c", 1)"#), r#"f(", 1)"#.len());
    assert_eq!(columns_without_text("//! | a | b |"), 0);
    assert_eq!(columns_without_text("let a = 1;"), 10);
}

#[test]
fn no_line_is_too_wide() {
    let mut wide = Vec::new();
    for file in sources(&["src", "tests", "examples", "benches"]) {
        for (i, line) in file.text.lines().enumerate() {
            let columns = line.chars().count();
            if columns > MAX_COLUMNS && columns_without_text(line) > MAX_COLUMNS {
                wide.push(format!("{}:{}: {columns} columns", file.path, i + 1));
            }
        }
    }
    assert!(wide.is_empty(), "{} lines are wider than {MAX_COLUMNS} columns:\n{}", wide.len(), wide.join("\n"));
}

/// Whether a line of documentation is part of a row of a table that goes on in another line, where no table can.
fn is_broken_row(line: &str) -> bool {
    let text = ["//!", "///"].iter().find_map(|start| line.trim_start().strip_prefix(start)).map_or("", str::trim);
    text == "|" || text.starts_with('|') != text.ends_with('|')
}

#[test]
fn rows_of_tables_are_whole() {
    let mut broken = Vec::new();
    for file in sources(&["src", "tests", "examples", "benches"]) {
        let lines = file.text.lines().enumerate().filter(|(_, line)| is_broken_row(line));
        broken.extend(lines.map(|(i, line)| format!("{}:{}: {line}", file.path, i + 1)));
    }
    assert!(broken.is_empty(), "write each row of a table into one line:\n{}", broken.join("\n"));
    assert!(is_broken_row("//! | a | b") && is_broken_row("    /// b |") && is_broken_row("//! |"));
    assert!(!is_broken_row("/// | a | b |") && !is_broken_row("// a |") && !is_broken_row("/// a | b"));
}

/// Lines from the unit tests at the foot of a file on.
fn test_lines(text: &str) -> usize {
    let lines: Vec<&str> = text.lines().collect();
    let start = lines.windows(2).position(|pair| pair[0] == "#[cfg(test)]" && pair[1].starts_with("mod "));
    start.map_or(0, |start| lines.len() - start)
}

#[test]
fn no_source_file_is_too_long() {
    let mut long = Vec::new();
    for file in sources(&["src"]) {
        let (lines, tests) = (file.text.lines().count(), test_lines(&file.text));
        if lines > MAX_LINES && tests as f64 <= TEST_FRACTION * lines as f64 {
            long.push(format!("{}: {lines} lines, {tests} of them unit tests", file.path));
        }
    }
    assert!(
        long.is_empty(),
        "{} files are longer than {MAX_LINES} lines and not over a quarter unit tests; split them by concept:\n{}",
        long.len(),
        long.join("\n")
    );
}

#[test]
fn unit_tests_count_from_their_module_on() {
    assert_eq!(test_lines("fn f() {}\n\n#[cfg(test)]\nmod tests {\n}\n"), 3);
    assert_eq!(test_lines("#[cfg(test)]\nuse a::b;\nfn f() {}\n"), 0);
}
