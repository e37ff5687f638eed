//! Looks in a file: the components of all things as RON, by way of reflection.
//!
//! Reflection knows the fields of each component, so that a program need not say how they are written. What a file
//! leaves out has its default.

use crate::{
    desk::THINGS,
    look::{Look, Looks},
};
use bevy::{
    prelude::*,
    reflect::{
        TypeRegistry,
        serde::{TypedReflectDeserializer, TypedReflectSerializer},
    },
};
use serde::de::DeserializeSeed;
use std::{any::TypeId, path::Path};

/// Returns what reflection has to know about the types of the file.
fn types() -> TypeRegistry {
    let mut types = TypeRegistry::new();
    types.register::<Looks>();
    // and with it the types of its fields
    types.register::<Look>();
    types
}

/// Writes looks to a file.
pub(crate) fn save(looks: &Looks, file: &Path) -> Result<(), String> {
    let fail = |error: &dyn std::fmt::Display| format!("cannot write the styles to {}: {error}", file.display());
    let text = ron::ser::to_string_pretty(&TypedReflectSerializer::new(looks, &types()), default());
    let text = text.map_err(|error| fail(&error))? + "\n";
    std::fs::write(file, text).map_err(|error| fail(&error))
}

/// Reads looks from a file.
pub(crate) fn load(file: &Path) -> Result<Looks, String> {
    let path = file.display();
    let text = std::fs::read_to_string(file)
        .map_err(|error| format!("cannot read the styles in {path}: {error}; `--save FILE.ron` writes such a file"))?;
    let looks = parse(&text).map_err(|problem| {
        // without the types that lead to the place
        let problem = problem.split(" (stack:").next().unwrap_or_default();
        format!("cannot read the styles in {path}: {problem}; compare it with what `--save FILE.ron` writes")
    })?;
    match looks.keys().find(|name| !THINGS.contains(&name.as_str())) {
        Some(name) => {
            let known = THINGS.join(", ");
            Err(format!("cannot use the styles in {path}: there is no thing {name:?}; the things are {known}"))
        }
        None => Ok(looks),
    }
}

fn parse(text: &str) -> Result<Looks, String> {
    let types = types();
    let registration = types.get(TypeId::of::<Looks>()).ok_or("its type is not registered")?;
    let mut file = ron::Deserializer::from_str(text).map_err(|error| error.to_string())?;
    let read = TypedReflectDeserializer::new(registration, &types).deserialize(&mut file);
    let read = read.and_then(|looks| file.end().map(|()| looks));
    // Position in the file and what is wrong there.
    let looks = read.map_err(|error| file.span_error(error).to_string())?;
    Looks::from_reflect(&*looks).ok_or_else(|| "a value is missing".to_owned())
}
