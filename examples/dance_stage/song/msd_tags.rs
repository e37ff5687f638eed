//! Tags of StepMania files: `#NAME:value:value;`.
//!
//! Text enters, tags with their lines leave. Text between tags is ignored. `//` starts a comment, which lasts until
//! the end of the line, and `\` takes its meaning from the character after it. Values may span lines; each line's end
//! is kept, so that the lines of a value can be counted.

use super::song_error::{Mistake, SongProblem};

/// Tag of a file.
#[derive(Debug, PartialEq)]
pub(super) struct Tag {
    /// In capital letters, without `#`.
    pub name: String,
    pub values: Vec<Value>,
    pub line: usize,
}

/// Value of a tag, without comments and escapes.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Value {
    pub text: String,
    /// Line in which the text begins.
    pub line: usize,
}

impl Value {
    fn starting_in(line: usize) -> Self {
        Self { text: String::new(), line }
    }

    /// Returns the line of the first character that is not white space.
    pub(super) fn first_line(&self) -> usize {
        let space = self.text.len() - self.text.trim_start().len();
        self.line + self.text[..space].matches('\n').count()
    }
}

impl Tag {
    /// Returns a value without the white space around it; empty if there is none.
    pub(super) fn text(&self, index: usize) -> &str {
        self.values.get(index).map_or("", |value| value.text.trim())
    }
}

/// Characters that mean something else without a `\` before them.
const SPECIAL: [char; 5] = ['\\', ':', ';', '#', '/'];

/// Returns text that is read as itself in a value.
pub(super) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        if SPECIAL.contains(&character) {
            escaped.push('\\');
        }
        escaped.push(character);
    }
    escaped
}

/// Reads all tags of a file.
pub(super) fn read_tags(text: &str) -> Result<Vec<Tag>, Mistake> {
    let mut tags = Vec::new();
    let mut open: Option<Open> = None;
    let mut characters = text.chars().peekable();
    let mut line = 1;
    // Whether only white space has come in this line so far.
    let mut is_line_blank = true;
    while let Some(character) = characters.next() {
        match (character, &mut open) {
            ('/', _) if characters.peek() == Some(&'/') => while characters.next_if(|next| *next != '\n').is_some() {},
            ('\\', open) => {
                let escaped = characters.next();
                if let (Some(open), Some(escaped)) = (open, escaped) {
                    open.value.text.push(escaped);
                }
                if escaped == Some('\n') {
                    line += 1;
                }
            }
            ('#', Some(open)) if is_line_blank => return Err(open.unclosed()),
            ('#', None) => open = Some(Open::starting_in(line)),
            (':', Some(open)) => open.end_value(line),
            (';', still_open @ Some(_)) => tags.extend(still_open.take().map(Open::close)),
            (character, open) => {
                if let Some(open) = open {
                    open.value.text.push(character);
                }
                if character == '\n' {
                    line += 1;
                }
            }
        }
        is_line_blank = character == '\n' || (is_line_blank && character.is_whitespace());
    }
    match open {
        Some(open) => Err(open.unclosed()),
        None => Ok(tags),
    }
}

/// Tag whose end has not been read yet.
struct Open {
    line: usize,
    /// Values that have ended. The first one is the tag's name.
    ended: Vec<Value>,
    value: Value,
}

impl Open {
    fn starting_in(line: usize) -> Self {
        Self { line, ended: Vec::new(), value: Value::starting_in(line) }
    }

    fn end_value(&mut self, line: usize) {
        self.ended.push(std::mem::replace(&mut self.value, Value::starting_in(line)));
    }

    fn close(mut self) -> Tag {
        self.ended.push(self.value);
        let name = self.ended.remove(0).text.trim().to_ascii_uppercase();
        Tag { name, values: self.ended, line: self.line }
    }

    fn unclosed(&self) -> Mistake {
        let name = &self.ended.first().unwrap_or(&self.value).text;
        // A tag may be open because its name never ended: what follows is not part of it.
        let tag = name.split_whitespace().next().unwrap_or_default().to_ascii_uppercase();
        SongProblem::Unclosed { tag }.at(self.line)
    }
}
