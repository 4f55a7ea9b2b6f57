//! Reading a table field by field, so that everything that is wrong with it is found.
use crate::diagnostic::Errors;
use crate::node::{Node, Table, Value};
use crate::problem::Problem;
use crate::source::Place;
use crate::suggest::nearest;
use serde::de::DeserializeOwned;

/// A table that is being read. Each method takes a field out; [`finish`](Section::finish) reports those that nobody
/// asked for. A method that returns `None` for a field that is required, or that is there, has reported why.
#[must_use = "finish it, so that unknown fields are reported"]
#[derive(Debug)]
pub struct Section<'e> {
    errors: &'e Errors,
    place: Place,
    rest: Table,
    /// What was asked for, and where it was.
    asked: Vec<(String, Option<Place>)>,
    /// Required and not there: reported at the end, when it is known which fields are left.
    missing: Vec<String>,
}

impl<'e> Section<'e> {
    /// A table to be read; anything else is an error. Nothing at all, as an empty YAML file is, is an empty table.
    pub fn new(node: Node, errors: &'e Errors) -> Option<Self> {
        let rest = match node.value {
            Value::Table(table) => table,
            Value::Null => Table::default(),
            _ => {
                let problem = Problem::wrong_type("a table", node.in_words());
                errors.report(node.place, problem);
                return None;
            }
        };
        Some(Section { errors, place: node.place, rest, asked: Vec::new(), missing: Vec::new() })
    }

    /// Where errors go.
    pub fn errors(&self) -> &'e Errors {
        self.errors
    }

    /// Where the table is.
    pub fn place(&self) -> &Place {
        &self.place
    }

    /// Where the value of a field is or was, for errors found later; the table's place, if it is not there.
    pub fn place_of(&self, field: &str) -> Place {
        let asked = || self.asked.iter().find(|(name, _)| name == field)?.1.clone();
        let place = self.rest.get(field).map(|f| f.node.place.clone());
        place.or_else(asked).unwrap_or_else(|| self.place.clone())
    }

    /// Whether the field is there and not yet taken.
    pub fn has(&self, field: &str) -> bool {
        self.rest.contains_key(field)
    }

    /// Reports a problem with a field, or with the table, if the field is not there.
    pub fn report(&self, field: &str, problem: Problem) {
        self.errors.report(self.place_of(field), problem);
    }

    /// Takes a field as it stands; nothing if it is not there, or null.
    pub fn take(&mut self, field: &str) -> Option<Node> {
        let taken = self.rest.shift_remove(field).map(|f| f.node);
        let place = taken.as_ref().map(|node| node.place.clone());
        match self.asked.iter_mut().find(|(name, _)| name == field) {
            Some((_, known)) => *known = place.or(known.take()),
            None => self.asked.push((field.to_owned(), place)),
        }
        taken.filter(|node| node.value != Value::Null)
    }

    /// Takes a field as it stands; an error if it is not there.
    pub fn take_required(&mut self, field: &str) -> Option<Node> {
        let node = self.take(field);
        if node.is_none() {
            self.missing.push(field.to_owned());
        }
        node
    }

    /// A field that has to be there.
    pub fn required<T: DeserializeOwned>(&mut self, field: &str) -> Option<T> {
        let node = self.take_required(field)?;
        node.read(self.errors)
    }

    /// A field that may be left out.
    pub fn optional<T: DeserializeOwned>(&mut self, field: &str) -> Option<T> {
        let node = self.take(field)?;
        node.read(self.errors)
    }

    /// A field that has a default; the default, too, after an error.
    pub fn or_default<T: DeserializeOwned + Default>(&mut self, field: &str) -> T {
        self.optional(field).unwrap_or_default()
    }

    /// A table that has to be there.
    pub fn section(&mut self, field: &str) -> Option<Section<'e>> {
        let node = self.take_required(field)?;
        Section::new(node, self.errors)
    }

    /// A table that may be left out.
    pub fn optional_section(&mut self, field: &str) -> Option<Section<'e>> {
        let node = self.take(field)?;
        Section::new(node, self.errors)
    }

    /// The elements of an array; none if it is not there.
    pub fn nodes(&mut self, field: &str) -> Vec<Node> {
        let taken = self.take(field);
        taken.map(|node| self.elements(node)).unwrap_or_default()
    }

    /// The tables of an array, as `[[field]]` writes them; none if it is not there. What is no table is an error.
    pub fn items(&mut self, field: &str) -> Vec<Section<'e>> {
        let nodes = self.nodes(field);
        self.sections(nodes)
    }

    /// The tables of an array that has to be there, empty or not.
    pub fn required_items(&mut self, field: &str) -> Vec<Section<'e>> {
        let taken = self.take_required(field);
        let nodes = taken.map(|node| self.elements(node)).unwrap_or_default();
        self.sections(nodes)
    }

    fn elements(&self, node: Node) -> Vec<Node> {
        match node.value {
            Value::Array(items) => items,
            _ => {
                let problem = Problem::wrong_type("an array", node.in_words());
                self.errors.report(node.place, problem);
                Vec::new()
            }
        }
    }

    fn sections(&self, nodes: Vec<Node>) -> Vec<Section<'e>> {
        let errors = self.errors;
        nodes.into_iter().filter_map(|node| Section::new(node, errors)).collect()
    }

    /// All fields that are left, as one serde type that denies unknown fields.
    pub fn rest<T: DeserializeOwned>(mut self) -> Option<T> {
        Node::new(self.place.clone(), Value::Table(std::mem::take(&mut self.rest))).read(self.errors)
    }

    /// Reports every field that was not asked for.
    pub fn finish(mut self) {
        let known: Vec<String> = std::mem::take(&mut self.asked).into_iter().map(|(name, _)| name).collect();
        for (field, value) in *std::mem::take(&mut self.rest) {
            // what is misspelled is not missing as well
            let meant = nearest(&field, known.iter().map(String::as_str));
            self.missing.retain(|missing| Some(missing.as_str()) != meant);
            self.errors.report(value.key, Problem::UnknownField { field, known: known.clone() });
        }
    }

    /// Drops the fields that are left without a word.
    pub fn ignore_rest(self) {}
}

impl Drop for Section<'_> {
    fn drop(&mut self) {
        for field in self.missing.drain(..) {
            self.errors.report(self.place.clone(), Problem::MissingField { field });
        }
    }
}
