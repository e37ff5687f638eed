//! What can be wrong with an authored scene, in sentences that say where and what to do.

use std::fmt;

/// Where an entry of extras stands, for messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NodeContext {
    /// The glTF file, as the user named it.
    pub file: String,
    /// The node's name; Bevy's `GltfNode` and its index if it has none.
    pub node: String,
}

impl NodeContext {
    /// The node called `node` of the file called `file`.
    pub fn new(file: impl Into<String>, node: impl Into<String>) -> Self {
        Self { file: file.into(), node: node.into() }
    }
}

impl fmt::Display for NodeContext {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}, node {:?}", self.file, self.node)
    }
}

/// One mistake in the extras of one node.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{context}: {problem}")]
pub struct ExtrasError {
    /// The node with the mistake.
    pub context: NodeContext,
    /// The mistake.
    pub problem: ExtrasProblem,
}

/// The kinds of mistakes in the extras of a node.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExtrasProblem {
    /// The text is no JSON. Cannot come from a file that has been loaded, only from extras made in code.
    #[error("the extras are not valid JSON ({reason}); correct them or leave them out")]
    NotJson {
        /// What the JSON parser says.
        reason: String,
    },
    /// The component's value is neither an object nor one of its words.
    #[error("{component} is {found}, expected {expected}; write it like that or remove {component}")]
    WrongForm {
        /// The component.
        component: &'static str,
        /// The value that stands there, shortened.
        found: String,
        /// The forms it may have.
        expected: String,
    },
    /// A mandatory field is not there.
    #[error("{component}.{field} is missing, expected {expected}; add it, for example {example}")]
    MissingField {
        /// The component.
        component: &'static str,
        /// The missing field.
        field: &'static str,
        /// What may stand there.
        expected: String,
        /// The value of a complete component.
        example: &'static str,
    },
    /// A field that the component does not have.
    #[error("{component}.{field} is unknown; {remedy}")]
    UnknownField {
        /// The component.
        component: &'static str,
        /// The unknown field.
        field: String,
        /// The nearest known field, or all of them.
        remedy: String,
    },
    /// A field's value is of another JSON type.
    #[error("{component}.{field} is {found}, which is of the wrong type; write {expected}{or_omit}")]
    WrongType {
        /// The component.
        component: &'static str,
        /// The field.
        field: &'static str,
        /// The value that stands there, shortened.
        found: String,
        /// What may stand there.
        expected: String,
        /// How else to get rid of the mistake: empty for a mandatory field.
        or_omit: &'static str,
    },
    /// A field's value is of the right type and not among those that the component accepts.
    #[error("{component}.{field} is {found}, which is not accepted; write {expected}{or_omit}")]
    OutOfRange {
        /// The component.
        component: &'static str,
        /// The field.
        field: &'static str,
        /// The value that stands there, shortened.
        found: String,
        /// What may stand there.
        expected: String,
        /// How else to get rid of the mistake: empty for a mandatory field.
        or_omit: &'static str,
    },
}

/// Extras whose name is nearly that of a component. They are left alone, as other tools' extras are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExtrasWarning {
    /// The node with the extras.
    pub context: NodeContext,
    /// The name that stands there.
    pub key: String,
    /// The component that may have been meant.
    pub meant: &'static str,
}

impl fmt::Display for ExtrasWarning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { context, key, meant } = self;
        write!(f, "{context}: {key:?} is left alone; rename it to {meant:?} if that component was meant")
    }
}

/// Why the components of a glTF file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AuthoringError {
    /// The file cannot be opened or read.
    #[error("{file}: cannot be read ({source}); check the path and the permissions")]
    Unreadable {
        /// The file.
        file: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file is not glTF 2.0, neither as text nor as binary, or is cut off.
    #[error("{file}: is not a glTF 2.0 file ({reason}); export it again as .glb or .gltf")]
    NotGltf {
        /// The file.
        file: String,
        /// What the parser stumbled over.
        reason: String,
    },
    /// The file says that it cannot be read without extensions that Bevy's loader does not have either.
    #[error("{file}: requires the glTF extensions {extensions:?}, which cannot be read; export it without them")]
    UnsupportedExtensions {
        /// The file.
        file: String,
        /// Their names, in the file's order.
        extensions: Vec<String>,
    },
    /// The file is glTF with contradictions, such as an index of something that is not there.
    #[error("{file}: is invalid glTF ({}); repair it or export it again", .problems.join(", "))]
    InvalidGltf {
        /// The file.
        file: String,
        /// Place and kind of every contradiction.
        problems: Vec<String>,
    },
    /// Mistakes in the extras: all of them, in the order of the nodes. Never empty.
    #[error("{}", in_lines(.0))]
    Extras(Vec<ExtrasError>),
}

/// One mistake a line.
pub(super) fn in_lines(errors: &[ExtrasError]) -> String {
    errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}
