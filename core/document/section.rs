//! Reading of a table field by field, so that all of its errors are found.
use crate::diagnostic::Errors;
use crate::fault::Fault;
use crate::node::{Field, Node, Value};
use crate::source::Place;
use crate::suggest::nearest;
use serde::de::DeserializeOwned;

/// A table that is being read. Each method takes one field; [`finish`](Section::finish) reports all remaining
/// fields as unknown. A method that returns `None` for a required or present field has reported the reason.
#[must_use = "finish it, so that unknown fields are reported"]
#[derive(Debug)]
pub struct Section<'e> {
    errors: &'e Errors,
    node: &'e Node,
    /// The fields that were requested, in order.
    asked: Vec<String>,
    /// Required fields that are missing. They are reported at the end, when the unknown fields are known.
    missing: Vec<String>,
}

impl<'e> Section<'e> {
    /// Starts to read a table. Any value except a table or null is an error. Null, such as an empty YAML
    /// file, counts as an empty table.
    pub fn new(node: &'e Node, errors: &'e Errors) -> Option<Self> {
        if !matches!(node.value, Value::Table(_) | Value::Null) {
            errors.report(node.place.clone(), Fault::wrong_type("a table", node.in_words()));
            return None;
        }
        Some(Section { errors, node, asked: Vec::new(), missing: Vec::new() })
    }

    /// Returns the collector of errors.
    pub fn errors(&self) -> &'e Errors {
        self.errors
    }

    /// Returns the position of the table.
    pub fn place(&self) -> &'e Place {
        &self.node.place
    }

    /// Returns the position of a field's value for later errors, or the position of the table if the field is
    /// missing.
    pub fn place_of(&self, field: &str) -> Place {
        self.node.field(field).unwrap_or(self.node).place.clone()
    }

    /// Returns whether a field exists and was not taken yet.
    pub fn has(&self, field: &str) -> bool {
        self.node.field(field).is_some() && !self.is_asked(field)
    }

    /// Reports a problem with a field, or with the table if the field is missing.
    pub fn report(&self, field: &str, problem: Fault) {
        self.errors.report(self.place_of(field), problem);
    }

    /// Takes a field without reading it. Returns `None` if it is missing, null, or was already taken.
    pub fn take(&mut self, field: &str) -> Option<&'e Node> {
        if self.is_asked(field) {
            return None;
        }
        self.asked.push(field.to_owned());
        self.node.field(field).filter(|node| node.value != Value::Null)
    }

    /// Takes a field without reading it. A missing field is an error.
    pub(crate) fn take_required(&mut self, field: &str) -> Option<&'e Node> {
        let node = self.take(field);
        if node.is_none() {
            self.missing.push(field.to_owned());
        }
        node
    }

    /// Reads a required field.
    pub fn required<T: DeserializeOwned>(&mut self, field: &str) -> Option<T> {
        self.take_required(field)?.read(self.errors)
    }

    /// Reads an optional field.
    pub fn optional<T: DeserializeOwned>(&mut self, field: &str) -> Option<T> {
        self.take(field)?.read(self.errors)
    }

    /// Reads a field with a default. Returns the default also after an error.
    pub fn or_default<T: DeserializeOwned + Default>(&mut self, field: &str) -> T {
        self.optional(field).unwrap_or_default()
    }

    /// Starts to read a required table.
    pub fn section(&mut self, field: &str) -> Option<Section<'e>> {
        Section::new(self.take_required(field)?, self.errors)
    }

    /// Starts to read an optional table.
    pub fn optional_section(&mut self, field: &str) -> Option<Section<'e>> {
        Section::new(self.take(field)?, self.errors)
    }

    /// Takes the elements of an optional array; empty if it is missing.
    pub fn nodes(&mut self, field: &str) -> &'e [Node] {
        let taken = self.take(field);
        self.elements(taken)
    }

    /// Takes the elements of a required array, which may be empty.
    pub fn required_nodes(&mut self, field: &str) -> &'e [Node] {
        let taken = self.take_required(field);
        self.elements(taken)
    }

    fn elements(&self, node: Option<&'e Node>) -> &'e [Node] {
        match node {
            None => &[],
            Some(Node { value: Value::Array(items), .. }) => items,
            Some(other) => {
                let problem = Fault::wrong_type("an array", other.in_words());
                self.errors.report(other.place.clone(), problem);
                &[]
            }
        }
    }

    /// Reads all remaining fields as one serde type. It should deny unknown fields.
    pub fn rest<T: DeserializeOwned>(mut self) -> Option<T> {
        let left = self.left().into_iter().map(|(name, field)| (name.clone(), field.clone())).collect();
        let rest = Node::new(self.node.place.clone(), Value::Table(Box::new(left)));
        let before = self.errors.len();
        let asked = std::mem::take(&mut self.asked);
        rest.read_what_is_right(&asked, self.errors).filter(|_| self.errors.len() == before)
    }

    /// Reports each field that was not requested.
    pub fn finish(mut self) {
        for (field, value) in self.left() {
            // a misspelled field is not reported as missing as well
            let meant = nearest(field, self.asked.iter().map(String::as_str));
            self.missing.retain(|missing| Some(missing.as_str()) != meant);
            let problem = Fault::UnknownField { field: field.clone(), known: self.asked.clone() };
            self.errors.report(value.key.clone(), problem);
        }
    }

    /// Drops the remaining fields without an error.
    pub fn ignore_rest(self) {}

    fn is_asked(&self, field: &str) -> bool {
        self.asked.iter().any(|name| name == field)
    }

    /// Returns the fields that were not requested.
    fn left(&self) -> Vec<(&'e String, &'e Field)> {
        let Value::Table(table) = &self.node.value else { return Vec::new() };
        table.iter().filter(|(name, _)| !self.is_asked(name)).collect()
    }
}

impl Drop for Section<'_> {
    fn drop(&mut self) {
        for field in self.missing.drain(..) {
            self.errors.report(self.node.place.clone(), Fault::MissingField { field });
        }
    }
}
