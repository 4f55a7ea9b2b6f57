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
    requested: Vec<String>,
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
        Some(Section { errors, node, requested: Vec::new(), missing: Vec::new() })
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

    /// Returns whether a field exists and was not requested yet.
    pub fn has(&self, field: &str) -> bool {
        self.node.field(field).is_some() && !self.is_requested(field)
    }

    /// Reports a problem with a field, or with the table if the field is missing.
    pub fn report(&self, field: &str, problem: Fault) {
        self.errors.report(self.place_of(field), problem);
    }

    /// Requests a field without reading it. Returns `None` if it is missing, null, or was already requested.
    pub fn optional_node(&mut self, field: &str) -> Option<&'e Node> {
        if self.is_requested(field) {
            return None;
        }
        self.requested.push(field.to_owned());
        self.node.field(field).filter(|node| node.value != Value::Null)
    }

    /// Requests a field without reading it. A missing field is an error.
    pub(crate) fn required_node(&mut self, field: &str) -> Option<&'e Node> {
        let node = self.optional_node(field);
        if node.is_none() {
            self.missing.push(field.to_owned());
        }
        node
    }

    /// Reads a required field.
    pub fn required<T: DeserializeOwned>(&mut self, field: &str) -> Option<T> {
        self.required_node(field)?.read(self.errors)
    }

    /// Reads an optional field.
    pub fn optional<T: DeserializeOwned>(&mut self, field: &str) -> Option<T> {
        self.optional_node(field)?.read(self.errors)
    }

    /// Reads a field with a default. Returns the default also after an error.
    pub fn or_default<T: DeserializeOwned + Default>(&mut self, field: &str) -> T {
        self.optional(field).unwrap_or_default()
    }

    /// Starts to read a required table.
    pub fn section(&mut self, field: &str) -> Option<Section<'e>> {
        Section::new(self.required_node(field)?, self.errors)
    }

    /// Starts to read an optional table.
    pub fn optional_section(&mut self, field: &str) -> Option<Section<'e>> {
        Section::new(self.optional_node(field)?, self.errors)
    }

    /// Requests the elements of an optional array; empty if it is missing.
    pub fn nodes(&mut self, field: &str) -> &'e [Node] {
        let node = self.optional_node(field);
        self.elements(node)
    }

    /// Requests the elements of a required array, which may be empty.
    pub fn required_nodes(&mut self, field: &str) -> &'e [Node] {
        let node = self.required_node(field);
        self.elements(node)
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
        let unread =
            self.unread_fields().into_iter().map(|(name, field)| (name.clone(), field.clone())).collect();
        let rest = Node::new(self.node.place.clone(), Value::Table(Box::new(unread)));
        let before = self.errors.len();
        let requested = std::mem::take(&mut self.requested);
        rest.read_partial(&requested, self.errors).filter(|_| self.errors.len() == before)
    }

    /// Reports each field that was not requested.
    pub fn finish(mut self) {
        for (field, value) in self.unread_fields() {
            // a misspelled field is not reported as missing as well
            let meant = nearest(field, self.requested.iter().map(String::as_str));
            self.missing.retain(|missing| Some(missing.as_str()) != meant);
            let problem = Fault::UnknownField { field: field.clone(), known: self.requested.clone() };
            self.errors.report(value.key.clone(), problem);
        }
    }

    /// Drops the remaining fields without an error.
    pub fn ignore_rest(self) {}

    fn is_requested(&self, field: &str) -> bool {
        self.requested.iter().any(|name| name == field)
    }

    /// Returns the fields that were not requested.
    fn unread_fields(&self) -> Vec<(&'e String, &'e Field)> {
        let Value::Table(table) = &self.node.value else { return Vec::new() };
        table.iter().filter(|(name, _)| !self.is_requested(name)).collect()
    }
}

impl Drop for Section<'_> {
    fn drop(&mut self) {
        for field in self.missing.drain(..) {
            self.errors.report(self.node.place.clone(), Fault::MissingField { field });
        }
    }
}
