//! What inspectors, remote tools and scenes find in the type registry.

use bevy::{
    ecs::reflect::{ReflectComponent, ReflectEvent, ReflectMessage, ReflectResource},
    prelude::*,
    reflect::TypeRegistration,
};
use std::path::Path;

/// A public type of the crate that the ECS knows, as its source says.
#[derive(Debug, PartialEq)]
struct PublicType {
    name: String,
    derives: Vec<String>,
}

/// What a derive makes of a type, and whether its registration says so.
const KINDS: [(&str, fn(&TypeRegistration) -> bool); 4] = [
    ("Component", |registration| registration.data::<ReflectComponent>().is_some()),
    ("Resource", |registration| registration.data::<ReflectResource>().is_some()),
    ("Message", |registration| registration.data::<ReflectMessage>().is_some()),
    ("EntityEvent", |registration| registration.data::<ReflectEvent>().is_some()),
];

/// Types of a source that are public and derive one of the [`KINDS`].
fn public_types(text: &str) -> Vec<PublicType> {
    let mut types = Vec::new();
    // At the start of a line: not those of examples in comments.
    for code in text.split("\n#[derive(").skip(1) {
        let Some((derives, rest)) = code.split_once(")]") else { continue };
        let derives: Vec<String> = derives.split(',').map(|derive| derive.trim().to_owned()).collect();
        // Between the derive and the type there are only attributes, which may take several lines.
        let item = rest.lines().find(|line| line.starts_with(char::is_alphabetic));
        let mut words = item.unwrap_or_default().split(|c: char| !c.is_alphanumeric() && c != '_');
        let (Some("pub"), Some("struct" | "enum"), Some(name)) = (words.next(), words.next(), words.next()) else {
            continue;
        };
        if KINDS.iter().any(|(kind, _)| derives.iter().any(|derive| derive == kind)) {
            types.push(PublicType { name: name.to_owned(), derives });
        }
    }
    types
}

fn all_public_types(folder: &Path) -> Vec<PublicType> {
    let mut types = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder of the package") {
        let path = entry.expect("a readable folder").path();
        if path.is_dir() {
            // The panel exists with its feature only.
            if cfg!(feature = "egui") || !path.ends_with("debug/panel") {
                types.extend(all_public_types(&path));
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            types.extend(public_types(&std::fs::read_to_string(&path).expect("sources are text")));
        }
    }
    types
}

#[test]
fn every_public_type_of_the_ecs_is_registered_without_any_plugin() {
    let app = App::new();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let types = all_public_types(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    let mut missing = Vec::new();
    for public in &types {
        let own = |registration: &&TypeRegistration| {
            let path = registration.type_info().type_path();
            path.starts_with("bevy_mirrorball::") && path.ends_with(&format!("::{}", public.name))
        };
        let registration = registry.iter().find(own);
        for (kind, is_known) in KINDS.iter().filter(|(kind, _)| public.derives.iter().any(|derive| derive == kind)) {
            if !registration.is_some_and(is_known) {
                missing.push(format!("{} is not registered as {kind}", public.name));
            }
        }
    }
    println!("{} types", types.len());
    assert!(types.len() > 40, "the form of the sources has changed, so that few are found: {types:?}");
    assert!(missing.is_empty(), "derive Reflect and write it into #[reflect(…)]:\n{}", missing.join("\n"));
}

#[test]
fn components_that_a_scene_may_name_without_values_have_defaults() {
    let app = App::new();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    for name in [
        "ArCamera",
        "CameraFeed",
        "MarkerAnchor",
        "MarkerBoard",
        "WorldOrigin",
        "PoseFilter",
        "LightProbeSphere",
        "LightProbeCamera",
        "EnvironmentFallback",
        "PhantomObject",
        "ShadowDomeLight",
        "ShowPhantoms",
        "SoftPhantomEdges",
        "SurfaceStyle",
        "DeskParallax",
        "SceneProbe",
        "NoNeighborReflections",
        "MapView",
    ] {
        let registration = registry.get_with_short_type_path(name).unwrap_or_else(|| panic!("{name} is registered"));
        assert!(registration.data::<ReflectDefault>().is_some(), "{name} has a default");
    }
}

#[test]
fn public_types_are_found_in_sources() {
    let text = "/// A.\n#[derive(Component, Clone)]\n#[require(\n    B,\n    C\n)]\npub struct A {\n}\n\n\
                #[derive(Resource)]\npub(crate) struct D;\n\n#[derive(ExtractComponent)]\npub struct E;\n\n\
                #[derive(\n    Message,\n    Clone\n)]\npub enum F {\n}\n";
    let names: Vec<String> = public_types(text).into_iter().map(|public| public.name).collect();
    assert_eq!(names, ["A", "F"]);
}
