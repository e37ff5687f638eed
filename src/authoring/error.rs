//! Errors and warnings about authored scenes. Their messages say where the mistake is and how to correct it.

use bevy::reflect::{Reflect, std_traits::ReflectDefault};
use std::fmt;

/// Kind of thing in a glTF file that has extras.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ExtrasPlace {
    /// A node (an object in Blender), or what Bevy spawns as an entity of its own: a mesh primitive or a light.
    #[default]
    Node,
    /// A mesh (the object's data in Blender). Its components go to every node that uses it.
    Mesh,
    /// A scene. Only a dome, a style and the weight of the measured light are taken from it.
    Scene,
    /// A material. Nothing is taken from it.
    Material,
}

impl ExtrasPlace {
    /// Returns whether a component of this name is taken from here.
    pub(super) fn takes(self, component: &str) -> bool {
        match self {
            Self::Node | Self::Mesh => true,
            Self::Scene => {
                matches!(component, "ShadowDomeLight" | "SurfaceStyle" | "StyleFade" | "MeasuredLightWeight")
            }
            Self::Material => false,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Node => "node",
            Self::Mesh => "mesh",
            Self::Scene => "scene",
            Self::Material => "material",
        }
    }
}

/// Location of extras, for messages.
#[derive(Reflect, Clone, Debug, PartialEq, Eq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct NodeContext {
    /// Path of the glTF file, as the user gave it.
    pub file: String,
    /// Name of the node, or of the [`place`](Self::place) that has the extras; if it has none, `GltfNode` and its
    /// index, as in Bevy.
    pub node: String,
    /// Kind of thing that has the extras.
    pub place: ExtrasPlace,
}

impl NodeContext {
    /// The location of the node `node` in the file `file`.
    pub fn new(file: impl Into<String>, node: impl Into<String>) -> Self {
        Self::at(ExtrasPlace::Node, file, node)
    }

    /// The location of a mesh, a scene or a material in a file.
    pub fn at(place: ExtrasPlace, file: impl Into<String>, name: impl Into<String>) -> Self {
        Self { file: file.into(), node: name.into(), place }
    }
}

impl fmt::Display for NodeContext {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}, {} {:?}", self.file, self.place.word(), self.node)
    }
}

/// One mistake in the extras of one node.
#[derive(Reflect, Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[reflect(Debug, Clone, PartialEq)]
#[error("{context}: {problem}")]
pub struct ExtrasError {
    /// The node with the mistake.
    pub context: NodeContext,
    /// The mistake.
    pub problem: ExtrasProblem,
}

/// Kind of mistake in the extras of a node.
#[derive(Reflect, Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[reflect(opaque)] // a problem in a list holds another problem
#[reflect(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ExtrasProblem {
    /// The text is not JSON. This happens only for extras created in code, not for those of a loaded file.
    #[error("the extras are not valid JSON ({reason}); correct them or leave them out")]
    NotJson {
        /// Error of the JSON parser.
        reason: String,
    },
    /// The component's value is neither an object nor one of its words.
    #[error("{component} is {found}, expected {expected}; write it like that or remove {component}")]
    WrongForm {
        /// The component.
        component: &'static str,
        /// The value found, shortened.
        found: String,
        /// The accepted forms.
        expected: String,
    },
    /// A mandatory field is missing.
    #[error("{component}.{field} is missing, expected {expected}; add it, for example {example}")]
    MissingField {
        /// The component.
        component: &'static str,
        /// The missing field.
        field: &'static str,
        /// The accepted values.
        expected: String,
        /// A complete value of the component.
        example: &'static str,
    },
    /// The component has no such field.
    #[error("{component}.{field} is unknown; {remedy}")]
    UnknownField {
        /// The component.
        component: &'static str,
        /// The unknown field.
        field: String,
        /// How to correct it: names the closest known field, or all of them.
        remedy: String,
    },
    /// A field's value has the wrong JSON type.
    #[error("{component}.{field} is {found}, which is of the wrong type; write {expected}{or_omit}")]
    WrongType {
        /// The component.
        component: &'static str,
        /// The field.
        field: &'static str,
        /// The value found, shortened.
        found: String,
        /// The accepted values.
        expected: String,
        /// The alternative of leaving the field out; empty for mandatory fields.
        or_omit: &'static str,
    },
    /// A field's value has the right type, but the component does not accept it.
    #[error("{component}.{field} is {found}, which is not accepted; write {expected}{or_omit}")]
    OutOfRange {
        /// The component.
        component: &'static str,
        /// The field.
        field: &'static str,
        /// The value found, shortened.
        found: String,
        /// The accepted values.
        expected: String,
        /// The alternative of leaving the field out; empty for mandatory fields.
        or_omit: &'static str,
    },
    /// Something in a list is wrong.
    #[error("number {number} of the list: {problem}")]
    InList {
        /// Place in the list, from 1.
        number: usize,
        /// The mistake.
        problem: Box<ExtrasProblem>,
    },
    /// Another component that this one belongs to is not there.
    #[error("{component} needs {needed} beside it; add that to the extras of the same node, for example {example}")]
    MissingNeighbor {
        /// The component.
        component: &'static str,
        /// The other component.
        needed: &'static str,
        /// A complete value of the other component.
        example: &'static str,
    },
    /// Each field is accepted, but not all of them together.
    #[error("{component} is not accepted: {reason}")]
    Contradiction {
        /// The component.
        component: &'static str,
        /// What is wrong with it, and how to correct it.
        reason: String,
    },
}

/// Warning about extras that are ignored: their name resembles that of a component, or is that of a component that is
/// not taken from where it stands.
#[derive(Reflect, Clone, Debug, PartialEq, Eq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct ExtrasWarning {
    /// The node with the extras.
    pub context: NodeContext,
    /// The name found.
    pub key: String,
    /// The component that was probably meant.
    pub meant: &'static str,
}

impl fmt::Display for ExtrasWarning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { context, key, meant } = self;
        if key == meant {
            return write!(
                f,
                "{context}: {key} is left alone, because it stands on a {}; put it on the node that it is meant for (in \
                 Blender the custom properties of the object)",
                context.place.word()
            );
        }
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
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is neither text nor binary glTF 2.0, or it is truncated.
    #[error("{file}: is not a glTF 2.0 file ({reason}); export it again as .glb or .gltf")]
    NotGltf {
        /// The file.
        file: String,
        /// Error of the parser.
        reason: String,
    },
    /// The file requires extensions that are not supported, by Bevy's loader neither.
    #[error("{file}: requires the glTF extensions {extensions:?}, which cannot be read; export it without them")]
    UnsupportedExtensions {
        /// The file.
        file: String,
        /// Names of the extensions, in the order of the file.
        extensions: Vec<String>,
    },
    /// The file is inconsistent glTF, for example with an index that is out of range.
    #[error("{file}: is invalid glTF ({}); repair it or export it again", .problems.join(", "))]
    InvalidGltf {
        /// The file.
        file: String,
        /// Place and kind of each inconsistency.
        problems: Vec<String>,
    },
    /// All mistakes in the extras, in the order of the nodes. Never empty.
    #[error("{}", in_lines(.0))]
    Extras(Vec<ExtrasError>),
}

/// Formats the errors, one per line.
pub(super) fn in_lines(errors: &[ExtrasError]) -> String {
    errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}
