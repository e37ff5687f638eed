//! Reads the components of a glTF file's nodes without an app.

use super::{
    component::AuthoredComponent,
    error::{AuthoringError, ExtrasWarning, NodeContext},
    extras::parse_node_extras,
};
use gltf::{Document, Gltf, json::validation::Error as Contradiction};
use std::path::Path;

/// The components of one node of a glTF file.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeComponents {
    /// Index of the node in the file.
    pub index: usize,
    /// Name of the node; if it has none, `GltfNode` and its index, as in Bevy.
    pub node: String,
    /// Components of the node, in alphabetical order of their names.
    pub components: Vec<AuthoredComponent>,
    /// Warnings about extras whose names resemble those of components.
    pub warnings: Vec<ExtrasWarning>,
}

/// Reads the components of all nodes of a `.glb` or `.gltf` file, in all of its scenes.
///
/// Nodes that have neither components nor warnings are left out. Buffers and images are not read and may be missing.
///
/// # Errors
/// [`AuthoringError::Extras`] lists the mistakes of all nodes if there are any. The other errors say why the file as a
/// whole cannot be used.
///
/// ```no_run
/// use bevy_mirrorball::authoring::read_scene_components;
///
/// match read_scene_components("assets/desk.glb".as_ref()) {
///     Ok(nodes) => nodes.iter().for_each(|node| println!("{}: {:?}", node.node, node.components)),
///     Err(error) => eprintln!("{error}"),
/// }
/// ```
pub fn read_scene_components(path: &Path) -> Result<Vec<NodeComponents>, AuthoringError> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|source| AuthoringError::Unreadable { file: file.clone(), source })?;
    let document = parse_document(&bytes, &file)?;

    let mut found = Vec::new();
    let mut errors = Vec::new();
    for node in document.nodes() {
        let Some(extras) = node.extras() else { continue };
        let index = node.index();
        let name = node.name().map_or_else(|| format!("GltfNode{index}"), ToString::to_string);
        let parsed = parse_node_extras(extras.get(), &NodeContext::new(&file, &name));
        errors.extend(parsed.errors);
        if !(parsed.components.is_empty() && parsed.warnings.is_empty()) {
            let (components, warnings) = (parsed.components, parsed.warnings);
            found.push(NodeComponents { index, node: name, components, warnings });
        }
    }
    if errors.is_empty() { Ok(found) } else { Err(AuthoringError::Extras(errors)) }
}

/// Parses and validates the glTF document in `bytes`.
fn parse_document(bytes: &[u8], file: &str) -> Result<Document, AuthoringError> {
    let not_gltf = |reason: String| AuthoringError::NotGltf { file: file.into(), reason };
    if is_glb_shorter_than_its_header(bytes) {
        return Err(not_gltf("the header promises less than a header".into()));
    }
    let gltf = Gltf::from_slice_without_validation(bytes).map_err(|error| not_gltf(error.to_string()))?;
    let required: Vec<String> = gltf.extensions_required().map(ToString::to_string).collect();
    Document::from_json(gltf.document.into_json()).map_err(|error| match error {
        gltf::Error::Validation(contradictions) => {
            let unsupported: Vec<String> = contradictions
                .iter()
                .filter(|(_, kind)| *kind == Contradiction::Unsupported)
                .filter_map(|(place, _)| required.iter().find(|name| place.as_str().contains(&format!("{name:?}"))))
                .cloned()
                .collect();
            if !unsupported.is_empty() {
                return AuthoringError::UnsupportedExtensions { file: file.into(), extensions: unsupported };
            }
            let problems = contradictions.iter().map(|(place, kind)| format!("{place}: {kind}")).collect();
            AuthoringError::InvalidGltf { file: file.into(), problems }
        }
        other => not_gltf(other.to_string()),
    })
}

/// Returns whether this is binary glTF whose stated length is less than the 12 bytes of its header. The parser would
/// underflow when it subtracts the header from that length.
fn is_glb_shorter_than_its_header(bytes: &[u8]) -> bool {
    const HEADER: u32 = 12;
    bytes.starts_with(b"glTF")
        && bytes
            .get(8..12)
            .and_then(|length| length.try_into().ok())
            .map(u32::from_le_bytes)
            .is_some_and(|n| n < HEADER)
}
