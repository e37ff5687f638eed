//! Reads the components of a glTF file's nodes, meshes and scenes without an app.

use super::{
    component::AuthoredComponent,
    error::{AuthoringError, ExtrasPlace, ExtrasWarning, NodeContext},
    extras::{ParsedExtras, names_in, parse_node_extras},
};
use crate::panic_text::panic_text;
use gltf::{Document, Gltf, json::validation::Error as Contradiction};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
};

/// The components of one node of a glTF file, or of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeComponents {
    /// What has the extras. Components of a mesh are listed with each node that uses it, and its warnings once, as
    /// those of the mesh.
    pub place: ExtrasPlace,
    /// Index of the node, scene, mesh or material in the file.
    pub index: usize,
    /// Name of the node; if it has none, `GltfNode` and its index, as in Bevy.
    pub node: String,
    /// Components, in alphabetical order of their names. Always empty for meshes and materials.
    pub components: Vec<AuthoredComponent>,
    /// Warnings about extras that are left alone and may have been meant.
    pub warnings: Vec<ExtrasWarning>,
}

/// Reads the components of all nodes of a `.glb` or `.gltf` file, in all of its scenes.
///
/// Nodes come first, in the order of the file, then meshes, scenes and materials with something to report. Those that
/// have neither components nor warnings are left out. Buffers and images are not read and may be missing.
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
    let mut read = |place, index, name: Option<&str>, extras: &gltf::json::Extras| {
        let default_name = || format!("{}{index}", default_name(place));
        let node = name.map_or_else(default_name, ToString::to_string);
        let json = extras.as_ref().map_or("{}", |extras| extras.get());
        let ParsedExtras { components, errors: mistakes, warnings } =
            parse_node_extras(json, &NodeContext::at(place, &*file, &*node));
        errors.extend(mistakes);
        NodeComponents { place, index, node, components, warnings }
    };
    let mut meshes: Vec<_> =
        document.meshes().map(|mesh| read(ExtrasPlace::Mesh, mesh.index(), mesh.name(), mesh.extras())).collect();
    for node in document.nodes() {
        let mut parsed = read(ExtrasPlace::Node, node.index(), node.name(), node.extras());
        let own = node.extras().as_ref().map(|extras| names_in(extras.get())).unwrap_or_default();
        let of_mesh = node.mesh().map(|mesh| meshes[mesh.index()].components.clone()).unwrap_or_default();
        parsed.components.extend(of_mesh.into_iter().filter(|component| !own.contains(&component.name().to_owned())));
        parsed.components.sort_by_key(AuthoredComponent::name);
        found.push(parsed);
    }
    meshes.iter_mut().for_each(|mesh| mesh.components.clear());
    found.append(&mut meshes);
    for scene in document.scenes() {
        found.push(read(ExtrasPlace::Scene, scene.index(), scene.name(), scene.extras()));
    }
    for (index, material) in document.materials().enumerate() {
        found.push(read(ExtrasPlace::Material, index, material.name(), material.extras()));
    }
    found.retain(|place| !(place.components.is_empty() && place.warnings.is_empty()));
    if errors.is_empty() { Ok(found) } else { Err(AuthoringError::Extras(errors)) }
}

/// Start of the name of what has none, as in Bevy.
fn default_name(place: ExtrasPlace) -> &'static str {
    match place {
        ExtrasPlace::Node => "GltfNode",
        ExtrasPlace::Mesh => "Mesh",
        ExtrasPlace::Scene => "Scene",
        ExtrasPlace::Material => "Material",
    }
}

/// Parses and validates the glTF document in `bytes`.
fn parse_document(bytes: &[u8], file: &str) -> Result<Document, AuthoringError> {
    let not_gltf = |reason: String| AuthoringError::NotGltf { file: file.into(), reason };
    if is_glb_shorter_than_its_header(bytes) {
        return Err(not_gltf("the header promises less than a header".into()));
    }
    let gltf = Gltf::from_slice_without_validation(bytes).map_err(|error| not_gltf(error.to_string()))?;
    let required: Vec<String> = gltf.extensions_required().map(ToString::to_string).collect();
    // The parser takes some indices for granted while it checks them.
    let check = AssertUnwindSafe(|| Document::from_json(gltf.document.into_json()));
    let checked = catch_unwind(check).map_err(|panic| {
        let reason = panic_text(&*panic).unwrap_or("no reason given");
        AuthoringError::InvalidGltf { file: file.into(), problems: vec![format!("the check gave up: {reason}")] }
    })?;
    checked.map_err(|error| match error {
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
