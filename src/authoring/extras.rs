//! Parses the extras of one node, which are JSON text, into components, errors and warnings. Needs no app.

use super::{
    closest_name::closest_name,
    component::AuthoredComponent,
    error::{AuthoringError, ExtrasError, ExtrasProblem, ExtrasWarning, NodeContext},
};
use serde_json::{Map, Value};

/// Result of parsing the extras of one node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParsedExtras {
    /// Components without mistakes, in alphabetical order of their names.
    pub components: Vec<AuthoredComponent>,
    /// All mistakes. Components with mistakes are not among [`components`](Self::components).
    pub errors: Vec<ExtrasError>,
    /// Warnings about extras that are left alone and may have been meant.
    pub warnings: Vec<ExtrasWarning>,
}

impl ParsedExtras {
    /// Returns the components if there are no mistakes, otherwise [`AuthoringError::Extras`]. Drops the warnings.
    pub fn into_result(self) -> Result<Vec<AuthoredComponent>, AuthoringError> {
        if self.errors.is_empty() { Ok(self.components) } else { Err(AuthoringError::Extras(self.errors)) }
    }
}

/// Parses the extras of one node, or of what else `context` names. `context` is repeated in errors and warnings.
///
/// Extras that are valid JSON but not an object contain no components; that is not a mistake. The value of a component
/// may be an object or a text with one.
///
/// ```
/// use bevy_mirrorball::authoring::{AuthoredComponent, NodeContext, parse_node_extras};
/// use bevy_mirrorball::phantom::PhantomObject;
///
/// let desk = NodeContext::new("desk.glb", "table");
/// let parsed = parse_node_extras(r#"{"PhantomObject": {"casts": false}, "cycles": 1}"#, &desk);
/// let phantom = PhantomObject { casts: false, ..Default::default() };
/// assert_eq!(parsed.components, [AuthoredComponent::PhantomObject(phantom)]);
///
/// let parsed = parse_node_extras(r#"{"PhantomObject": {"casts": 0}}"#, &desk);
/// assert_eq!(
///     parsed.errors[0].to_string(),
///     r#"desk.glb, node "table": PhantomObject.casts is 0, which is of the wrong type; write true or false, or leave it out for the default"#,
/// );
/// ```
pub fn parse_node_extras(json: &str, context: &NodeContext) -> ParsedExtras {
    let mut parsed = ParsedExtras::default();
    let error = |problem| ExtrasError { context: context.clone(), problem };
    let entries = match serde_json::from_str(json) {
        Ok(Value::Object(entries)) => entries,
        Ok(_) => return parsed,
        Err(reason) => {
            parsed.errors.push(error(ExtrasProblem::NotJson { reason: reason.to_string() }));
            return parsed;
        }
    };
    // `serde_json` keeps the order of the file if any crate of the build enables that.
    let mut keys: Vec<_> = entries.keys().cloned().collect();
    keys.sort();
    // Components stand beside each other as objects, however they are written.
    let entries: Map<_, _> = entries.into_iter().map(|(key, value)| (key, as_object(value))).collect();
    for key in keys {
        let known = AuthoredComponent::NAMES.iter().find(|name| **name == key);
        if let Some(meant) = known.filter(|name| !context.place.takes(name)) {
            parsed.warnings.push(ExtrasWarning { context: context.clone(), key, meant });
            continue;
        }
        match AuthoredComponent::read(&key, &entries) {
            Some(Ok(component)) => parsed.components.push(component),
            Some(Err(problems)) => parsed.errors.extend(problems.into_iter().map(error)),
            None => {
                if let Some(meant) = closest_name(&key, AuthoredComponent::NAMES) {
                    parsed.warnings.push(ExtrasWarning { context: context.clone(), key, meant });
                }
            }
        }
    }
    parsed
}

/// Returns the names in extras; none if they are not a JSON object.
pub(super) fn names_in(json: &str) -> Vec<String> {
    match serde_json::from_str(json) {
        Ok(Value::Object(entries)) => entries.into_iter().map(|(name, _)| name).collect(),
        _ => Vec::new(),
    }
}

/// Returns the object in a text: what Blender writes for a custom property of type string, the easiest to make.
fn as_object(value: Value) -> Value {
    match &value {
        Value::String(text) => serde_json::from_str(text).ok().filter(Value::is_object).unwrap_or(value),
        _ => value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        authoring::ExtrasPlace,
        phantom::PhantomObject,
        probe::LightProbeSphere,
        shadows::{DomeCoverage, ShadowDomeLight, ShadowFilter, VisibilitySamples},
        tracking::{MarkerAnchor, WorldOrigin},
    };

    fn parse(json: &str) -> ParsedExtras {
        parse_node_extras(json, &NodeContext::new("set.glb", "thing"))
    }

    /// Returns the message of the only mistake, without its context.
    fn complaint(json: &str) -> String {
        let parsed = parse(json);
        assert_eq!(parsed.errors.len(), 1, "{json}: {parsed:?}");
        assert_eq!(parsed.components, [], "{json}");
        parsed.errors[0].problem.to_string()
    }

    #[test]
    fn omitted_fields_take_the_defaults() {
        let json = r#"{"LightProbeSphere": {}, "PhantomObject": {}, "ShadowDomeLight": {}, "WorldOrigin": {},
            "MarkerAnchor": {"id": 3, "size": 0.2}}"#;
        let expected = vec![
            AuthoredComponent::LightProbeSphere(LightProbeSphere::default()),
            AuthoredComponent::MarkerAnchor(MarkerAnchor::new(3, 0.2)),
            AuthoredComponent::PhantomObject(PhantomObject::default()),
            AuthoredComponent::ShadowDomeLight(ShadowDomeLight::default()),
            AuthoredComponent::WorldOrigin(WorldOrigin),
        ];
        assert_eq!(parse(json), ParsedExtras { components: expected, ..ParsedExtras::default() });
    }

    #[test]
    fn given_fields_are_taken_over() {
        let json = r#"{"LightProbeSphere": {"radius": 0.03, "reflectance": 0.65}, "PhantomObject": {"receives": false},
            "ShadowDomeLight": {"directions": 16, "resolution": 100}}"#;
        let expected = [
            AuthoredComponent::LightProbeSphere(LightProbeSphere {
                radius: 0.03,
                reflectance: 0.65,
                ..Default::default()
            }),
            AuthoredComponent::PhantomObject(PhantomObject { receives: false, ..PhantomObject::default() }),
            AuthoredComponent::ShadowDomeLight(ShadowDomeLight {
                directions: 16,
                resolution: 100,
                ..Default::default()
            }),
        ];
        assert_eq!(parse(json).into_result().expect("no mistake"), expected);
    }

    #[test]
    fn components_may_be_given_as_text() {
        let json = r#"{"MarkerAnchor": "{\"id\": 3, \"size\": 0.2}", "WorldOrigin": "{}"}"#;
        let expected =
            [AuthoredComponent::MarkerAnchor(MarkerAnchor::new(3, 0.2)), AuthoredComponent::WorldOrigin(WorldOrigin)];
        assert_eq!(parse(json).into_result().expect("no mistake"), expected);
        let message = complaint(r#"{"LightProbeSphere": "{\"radius\": 0}"}"#);
        assert!(message.contains("LightProbeSphere.radius"), "{message}");
        let message = complaint(r#"{"LightProbeSphere": "radius 5"}"#);
        assert!(message.contains("radius 5") && message.contains("object"), "{message}");
    }

    #[test]
    fn extras_of_other_tools_are_left_alone() {
        for json in [r#"{"cycles": {"id": 1}, "Anchor": 2, "targetNames": []}"#, "{}", "7", "null", "\"text\"", "[1]"] {
            assert_eq!(parse(json), ParsedExtras::default(), "{json}");
        }
    }

    #[test]
    fn a_nearly_right_name_is_a_warning_that_names_both() {
        let parsed = parse(r#"{"phantomObject": {}, "WorldOrgin": {}}"#);
        assert_eq!((parsed.components.len(), parsed.errors.len()), (0, 0));
        let texts: Vec<_> = parsed.warnings.iter().map(ToString::to_string).collect();
        assert_eq!(
            texts,
            [
                r#"set.glb, node "thing": "WorldOrgin" is left alone; rename it to "WorldOrigin" if that component was meant"#,
                r#"set.glb, node "thing": "phantomObject" is left alone; rename it to "PhantomObject" if that component was meant"#,
            ]
        );
    }

    #[test]
    fn mandatory_fields_are_asked_for() {
        assert_eq!(
            complaint(r#"{"MarkerAnchor": {"id": 0}}"#),
            "MarkerAnchor.size is missing, expected a number above 0 (meters); add it, for example {\"id\": 0, \"size\": 0.1}"
        );
    }

    #[test]
    fn unknown_fields_are_named_with_what_was_meant() {
        let of_ball = |field: &str| complaint(&format!(r#"{{"LightProbeSphere": {{"{field}": 0.1}}}}"#));
        assert_eq!(of_ball("Radius"), r#"LightProbeSphere.Radius is unknown; rename it to "radius" or remove it"#);
        assert_eq!(
            of_ball("diameter"),
            "LightProbeSphere.diameter is unknown; remove it, the fields are radius, reflectance, surface"
        );
        assert_eq!(
            complaint(r#"{"WorldOrigin": {"id": 0}}"#),
            "WorldOrigin.id is unknown; remove it, the component has no fields"
        );
    }

    #[test]
    fn wrong_types_and_ranges_are_named_with_value_and_remedy() {
        assert_eq!(
            complaint(r#"{"LightProbeSphere": {"radius": "5 cm"}}"#),
            "LightProbeSphere.radius is \"5 cm\", which is of the wrong type; write a number above 0 (meters), or leave it out \
             for the default"
        );
        assert_eq!(
            complaint(r#"{"LightProbeSphere": {"reflectance": 90}}"#),
            "LightProbeSphere.reflectance is 90, which is not accepted; write a number above 0 and at most 1, or leave it out \
             for the default"
        );
        assert_eq!(
            complaint(r#"{"MarkerAnchor": {"id": 587, "size": 0.1}}"#),
            "MarkerAnchor.id is 587, which is not accepted; write a whole number from 0 to 586"
        );
        assert_eq!(
            complaint(r#"{"MarkerAnchor": {"id": 35, "size": 0.1, "family": "tag25h9"}}"#),
            "MarkerAnchor.id is 35, which is not accepted; write a whole number from 0 to 34"
        );
        let message = complaint(r#"{"MarkerAnchor": {"id": 0, "size": 0.1, "family": "aruco"}}"#);
        assert!(message.starts_with("MarkerAnchor.family is \"aruco\", which is not accepted; write \"tag36h11\""));
        assert_eq!(
            complaint(r#"{"ShadowDomeLight": {"directions": 0}}"#),
            "ShadowDomeLight.directions is 0, which is not accepted; write a whole number from 1 to 1024, or leave it out for \
             the default"
        );
        assert_eq!(
            complaint(r#"{"WorldOrigin": true}"#),
            "WorldOrigin is true, expected an object such as {}; write it like that or remove WorldOrigin"
        );
    }

    #[test]
    fn one_mistake_does_not_hide_another_nor_the_rest() {
        let parsed = parse(r#"{"MarkerAnchor": {"id": -1, "sise": 0.1}, "WorldOrigin": {}}"#);
        assert_eq!(parsed.components, [AuthoredComponent::WorldOrigin(WorldOrigin)]);
        let problems: Vec<_> = parsed.errors.iter().map(|error| &error.problem).collect();
        assert!(
            matches!(
                problems[..],
                [
                    ExtrasProblem::OutOfRange { field: "id", .. },
                    ExtrasProblem::MissingField { field: "size", .. },
                    ExtrasProblem::UnknownField { .. }
                ]
            ),
            "{problems:?}"
        );
        assert!(matches!(parsed.into_result(), Err(AuthoringError::Extras(errors)) if errors.len() == 3));
    }

    #[test]
    fn domes_are_read_with_all_their_fields() {
        let json = r#"{"ShadowDomeLight": {"directions": 128, "coverage": "Sphere", "key_lights": 3, "resolution": 64,
            "filter": "Pcss", "angular_radius": 0.2, "samples": "Full", "refreshed_per_frame": 32, "dim_share": 0.01,
            "surfels": 256, "occludes_reflections": true}}"#;
        let expected = ShadowDomeLight {
            directions: 128,
            coverage: DomeCoverage::Sphere,
            key_lights: 3,
            resolution: 64,
            filter: ShadowFilter::Pcss { angular_radius: 0.2 },
            samples: VisibilitySamples::Full,
            refreshed_per_frame: 32,
            dim_share: 0.01,
            surfels: 256,
            occludes_reflections: true,
        };
        let found = parse(json).into_result().expect("no mistake");
        assert_eq!(found, [AuthoredComponent::ShadowDomeLight(expected)]);
        let complaint = complaint(r#"{"ShadowDomeLight": {"filter": "Soft"}}"#);
        assert!(complaint.contains("filter is \"Soft\"") && complaint.contains("\"Pcf49\""), "{complaint}");
    }

    #[test]
    fn scenes_and_materials_say_what_is_not_taken_from_them() {
        let json = r#"{"PhantomObject": {}, "ShadowDomeLight": {}, "paint": 1}"#;
        let read = |place| parse_node_extras(json, &NodeContext::at(place, "set.glb", "wood"));
        let scene = read(ExtrasPlace::Scene);
        assert_eq!(scene.components, [AuthoredComponent::ShadowDomeLight(ShadowDomeLight::default())]);
        assert_eq!(
            scene.warnings[0].to_string(),
            "set.glb, scene \"wood\": PhantomObject is left alone, because it stands on a scene; put it on the node that it is \
             meant for (in Blender the custom properties of the object)"
        );
        let material = read(ExtrasPlace::Material);
        assert_eq!((material.components.len(), material.warnings.len()), (0, 2));
        assert_eq!(read(ExtrasPlace::Mesh).components.len(), 2);
    }

    #[test]
    fn text_that_is_no_json_is_an_error() {
        assert!(complaint("{").starts_with("the extras are not valid JSON ("));
    }
}
