//! Reading a table field by field, so that everything that is wrong with it is found.
use crate::diagnostic::Errors;
use crate::fault::Fault;
use crate::node::{Field, Node, Value};
use crate::source::Place;
use crate::suggest::nearest;
use serde::de::DeserializeOwned;

/// A table that is being read. Each method takes a field out; [`finish`](Section::finish) reports those that nobody
/// asked for. A method that returns `None` for a field that is required, or that is there, has reported why.
#[must_use = "finish it, so that unknown fields are reported"]
#[derive(Debug)]
pub struct Section<'e> {
    errors: &'e Errors,
    node: &'e Node,
    /// What was asked for, in this order.
    asked: Vec<String>,
    /// Required and not there: reported at the end, when it is known which fields are left.
    missing: Vec<String>,
}

impl<'e> Section<'e> {
    /// A table to be read; anything else is an error. Nothing at all, as an empty YAML file is, is an empty table.
    pub fn new(node: &'e Node, errors: &'e Errors) -> Option<Self> {
        if !matches!(node.value, Value::Table(_) | Value::Null) {
            errors.report(node.place.clone(), Fault::wrong_type("a table", node.in_words()));
            return None;
        }
        Some(Section { errors, node, asked: Vec::new(), missing: Vec::new() })
    }

    /// Where errors go.
    pub fn errors(&self) -> &'e Errors {
        self.errors
    }

    /// Where the table is.
    pub fn place(&self) -> &'e Place {
        &self.node.place
    }

    /// Where the value of a field is, for errors found later; the table's place, if it is not there.
    pub fn place_of(&self, field: &str) -> Place {
        self.node.field(field).unwrap_or(self.node).place.clone()
    }

    /// Returns whether the field is there and not yet taken.
    pub fn has(&self, field: &str) -> bool {
        self.node.field(field).is_some() && !self.is_asked(field)
    }

    /// Reports a problem with a field, or with the table, if the field is not there.
    pub fn report(&self, field: &str, problem: Fault) {
        self.errors.report(self.place_of(field), problem);
    }

    /// Takes a field as it stands; nothing if it is not there, null, or taken already.
    pub fn take(&mut self, field: &str) -> Option<&'e Node> {
        if self.is_asked(field) {
            return None;
        }
        self.asked.push(field.to_owned());
        self.node.field(field).filter(|node| node.value != Value::Null)
    }

    /// Takes a field as it stands; an error if it is not there.
    pub(crate) fn take_required(&mut self, field: &str) -> Option<&'e Node> {
        let node = self.take(field);
        if node.is_none() {
            self.missing.push(field.to_owned());
        }
        node
    }

    /// A field that has to be there.
    pub fn required<T: DeserializeOwned>(&mut self, field: &str) -> Option<T> {
        self.take_required(field)?.read(self.errors)
    }

    /// A field that may be left out.
    pub fn optional<T: DeserializeOwned>(&mut self, field: &str) -> Option<T> {
        self.take(field)?.read(self.errors)
    }

    /// A field that has a default; the default, too, after an error.
    pub fn or_default<T: DeserializeOwned + Default>(&mut self, field: &str) -> T {
        self.optional(field).unwrap_or_default()
    }

    /// A table that has to be there.
    pub fn section(&mut self, field: &str) -> Option<Section<'e>> {
        Section::new(self.take_required(field)?, self.errors)
    }

    /// A table that may be left out.
    pub fn optional_section(&mut self, field: &str) -> Option<Section<'e>> {
        Section::new(self.take(field)?, self.errors)
    }

    /// The elements of an array; none if it is not there.
    pub fn nodes(&mut self, field: &str) -> &'e [Node] {
        let taken = self.take(field);
        self.elements(taken)
    }

    /// The elements of an array that has to be there, empty or not.
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

    /// All fields that are left, as one serde type that denies unknown fields.
    pub fn rest<T: DeserializeOwned>(mut self) -> Option<T> {
        let left = self.left().into_iter().map(|(name, field)| (name.clone(), field.clone())).collect();
        let rest = Node::new(self.node.place.clone(), Value::Table(Box::new(left)));
        let before = self.errors.len();
        let asked = std::mem::take(&mut self.asked);
        rest.read_what_is_right(&asked, self.errors).filter(|_| self.errors.len() == before)
    }

    /// Reports every field that was not asked for.
    pub fn finish(mut self) {
        for (field, value) in self.left() {
            // what is misspelled is not missing as well
            let meant = nearest(field, self.asked.iter().map(String::as_str));
            self.missing.retain(|missing| Some(missing.as_str()) != meant);
            let problem = Fault::UnknownField { field: field.clone(), known: self.asked.clone() };
            self.errors.report(value.key.clone(), problem);
        }
    }

    /// Drops the fields that are left without a word.
    pub fn ignore_rest(self) {}

    fn is_asked(&self, field: &str) -> bool {
        self.asked.iter().any(|name| name == field)
    }

    /// The fields that were not asked for.
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
