//! Fields of one JSON object: reads them by rules and collects all problems.

use super::{
    closest_name::closest_name,
    error::ExtrasProblem,
    rules::{List, Mismatch, Object, Rule, shown},
};
use serde_json::{Map, Value};

/// The fields of one component. Every field that is read becomes known; fields that were never read are reported at the
/// end.
pub(super) struct Fields<'a> {
    component: &'static str,
    example: &'static str,
    object: &'a Map<String, Value>,
    beside: &'a Map<String, Value>,
    known: Vec<&'static str>,
    problems: Vec<ExtrasProblem>,
}

impl<'a> Fields<'a> {
    /// Starts with `object`, which is the value of `component`; `example` is a complete value of that component, and
    /// `beside` are all extras that it stands among.
    pub(super) fn new(
        component: &'static str,
        example: &'static str,
        object: &'a Map<String, Value>,
        beside: &'a Map<String, Value>,
    ) -> Self {
        Self { component, example, object, beside, known: Vec::new(), problems: Vec::new() }
    }

    /// Returns the value of another component in the same extras.
    pub(super) fn beside(&self, component: &str) -> Option<&'a Value> {
        self.beside.get(component)
    }

    /// Returns whether the object has no fields at all.
    pub(super) fn is_empty(&self) -> bool {
        self.object.is_empty()
    }

    /// Returns whether the object has a field.
    pub(super) fn has(&self, field: &str) -> bool {
        self.object.contains_key(field)
    }

    /// Notes a problem that is not one of a single field.
    pub(super) fn note(&mut self, problem: ExtrasProblem) {
        self.problems.push(problem);
    }

    /// Reads a mandatory field. Returns `None` and notes a problem if it is absent or wrong.
    pub(super) fn required<R: Rule>(&mut self, field: &'static str, rule: R) -> Option<R::Value> {
        if !self.object.contains_key(field) {
            let Self { component, example, .. } = *self;
            self.known.push(field);
            self.problems.push(ExtrasProblem::MissingField { component, field, expected: rule.expected(), example });
            return None;
        }
        self.read(field, rule, "")
    }

    /// Reads an optional field. Returns `None` if it is absent, and also notes a problem if it is wrong.
    pub(super) fn optional<R: Rule>(&mut self, field: &'static str, rule: R) -> Option<R::Value> {
        self.read(field, rule, ", or leave it out for the default")
    }

    /// Reads a mandatory field whose value is an object with fields of its own; its problems name that object `path`.
    /// Returns `None` and notes the problems if the object is absent or anything in it is wrong.
    pub(super) fn required_object<T>(
        &mut self,
        field: &'static str,
        path: &'static str,
        read: impl FnOnce(&mut Fields) -> T,
    ) -> Option<T> {
        let object = self.required(field, Object)?;
        let (value, problems) = self.read_object(path, &object, read);
        let is_faultless = problems.is_empty();
        self.problems.extend(problems);
        is_faultless.then_some(value)
    }

    /// Reads an optional field whose value is such an object. Returns `None` if it is absent, and also notes the
    /// problems if anything in it is wrong.
    pub(super) fn optional_object<T>(
        &mut self,
        field: &'static str,
        path: &'static str,
        read: impl FnOnce(&mut Fields) -> T,
    ) -> Option<T> {
        if self.object.contains_key(field) {
            return self.required_object(field, path, read);
        }
        self.known.push(field);
        None
    }

    /// Reads an optional field whose value is a list of such objects; problems name their number, from 1. Returns
    /// `None` if it is absent, and also notes the problems if anything in it is wrong.
    pub(super) fn optional_objects<T>(
        &mut self,
        field: &'static str,
        path: &'static str,
        mut read: impl FnMut(&mut Fields) -> Option<T>,
    ) -> Option<Vec<T>> {
        let list = self.optional(field, List)?;
        let (mut values, noted) = (Vec::new(), self.problems.len());
        for (number, object) in (1..).zip(&list) {
            let (value, problems) = self.read_object(path, object, &mut read);
            values.extend(value);
            let in_list = |problem| ExtrasProblem::InList { number, problem: Box::new(problem) };
            self.problems.extend(problems.into_iter().map(in_list));
        }
        (self.problems.len() == noted).then_some(values)
    }

    /// Reads an object within this one.
    fn read_object<T>(
        &self,
        path: &'static str,
        object: &Map<String, Value>,
        read: impl FnOnce(&mut Fields) -> T,
    ) -> (T, Vec<ExtrasProblem>) {
        let mut inner = Fields::new(path, self.example, object, self.beside);
        let value = read(&mut inner);
        (value, inner.into_problems())
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

    /// Returns all problems, including fields that were never read.
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
