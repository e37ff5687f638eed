//! Reads the fields of one JSON object by rules and collects everything that is wrong with them.

use super::{
    closest_name::closest_name,
    error::ExtrasProblem,
    rules::{Mismatch, Object, Rule, shown},
};
use serde_json::{Map, Value};

/// The fields of one component. Asking for a field makes it known; what was never asked for is an error at the end.
pub(super) struct Fields<'a> {
    component: &'static str,
    example: &'static str,
    object: &'a Map<String, Value>,
    known: Vec<&'static str>,
    problems: Vec<ExtrasProblem>,
}

impl<'a> Fields<'a> {
    /// The fields of `object`, which is the value of `component`; `example` is a complete value of it.
    pub(super) fn new(component: &'static str, example: &'static str, object: &'a Map<String, Value>) -> Self {
        Self { component, example, object, known: Vec::new(), problems: Vec::new() }
    }

    /// The field's value; `None` if it is absent or wrong, which is noted.
    pub(super) fn required<R: Rule>(&mut self, field: &'static str, rule: R) -> Option<R::Value> {
        if !self.object.contains_key(field) {
            let Self { component, example, .. } = *self;
            self.known.push(field);
            self.problems.push(ExtrasProblem::MissingField { component, field, expected: rule.expected(), example });
            return None;
        }
        self.read(field, rule, "")
    }

    /// The field's value; `None` if it is absent, or wrong, which is noted.
    pub(super) fn optional<R: Rule>(&mut self, field: &'static str, rule: R) -> Option<R::Value> {
        self.read(field, rule, ", or leave it out for the default")
    }

    /// What is read from the fields of an object that stands in the field; problems in there name it as `path`. `None` if
    /// the object is absent or something in it is wrong, which is noted.
    pub(super) fn required_object<T>(
        &mut self,
        field: &'static str,
        path: &'static str,
        read: impl FnOnce(&mut Fields) -> T,
    ) -> Option<T> {
        let object = self.required(field, Object)?;
        let mut inner = Fields::new(path, self.example, &object);
        let value = read(&mut inner);
        let problems = inner.into_problems();
        let is_faultless = problems.is_empty();
        self.problems.extend(problems);
        is_faultless.then_some(value)
    }

    fn read<R: Rule>(&mut self, field: &'static str, rule: R, or_omit: &'static str) -> Option<R::Value> {
        self.known.push(field);
        let json = self.object.get(field)?;
        let component = self.component;
        let (found, expected) = (shown(json), rule.expected());
        match rule.read(json) {
            Ok(value) => return Some(value),
            Err(Mismatch::Type) => {
                self.problems.push(ExtrasProblem::WrongType { component, field, found, expected, or_omit });
            }
            Err(Mismatch::Range) => {
                self.problems.push(ExtrasProblem::OutOfRange { component, field, found, expected, or_omit });
            }
        }
        None
    }

    /// Everything that was wrong, including fields that nobody asked for.
    pub(super) fn into_problems(self) -> Vec<ExtrasProblem> {
        let Self { component, object, known, mut problems, .. } = self;
        for field in object.keys().filter(|field| !known.contains(&field.as_str())) {
            let remedy = match closest_name(field, &known) {
                Some(meant) => format!("rename it to {meant:?} or remove it"),
                None if known.is_empty() => "remove it, the component has no fields".into(),
                None => format!("remove it, the fields are {}", known.join(", ")),
            };
            problems.push(ExtrasProblem::UnknownField { component, field: field.clone(), remedy });
        }
        problems
    }
}
