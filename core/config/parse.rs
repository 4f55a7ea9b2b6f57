//! Reads a serde type out of a node, with every error at its exact place.
use crate::diagnostic::{Diagnostic, Errors};
use crate::message::problem_of;
use crate::node::{Node, Value};
use crate::problem::Problem;
use crate::source::Place;
use crate::suggest::nearest;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use serde_path_to_error::{Path, Segment};

/// What serde_path_to_error says of a failure.
pub(crate) type ParseError = serde_path_to_error::Error<serde_json::Error>;

impl Node {
    /// Reads a serde type; what is wrong goes to `errors`.
    pub fn read<T: DeserializeOwned>(&self, errors: &Errors) -> Option<T> {
        self.read_with(errors, serde_path_to_error::deserialize)
    }

    /// Reads with any function from JSON. Serde stops at the first error; an unknown field is taken out and reading
    /// goes on, so that all of them are found.
    pub(crate) fn read_with<T>(
        &self,
        errors: &Errors,
        parse: impl Fn(Json) -> Result<T, ParseError>,
    ) -> Option<T> {
        let json = self.to_json().map_err(|list| errors.extend(list)).ok()?;
        let mut failure = match parse(json) {
            Ok(value) => return Some(value),
            Err(failure) => failure,
        };
        let mut json = self.to_json().ok()?;
        let mut meant: Vec<String> = Vec::new();
        loop {
            let (place, problem) = self.explain(&failure);
            match &problem {
                Problem::UnknownField { field, known } => {
                    let near = nearest(field, known.iter().map(String::as_str));
                    meant.extend(near.map(str::to_owned));
                    let removed = remove(&mut json, failure.path(), field);
                    errors.report(place, problem);
                    if !removed {
                        return None;
                    }
                }
                // the unknown field's message has said what it should be called
                Problem::MissingField { field } if meant.contains(field) => return None,
                _ => {
                    errors.report(place, problem);
                    return None;
                }
            }
            match parse(json.clone()) {
                Ok(_) => return None,
                Err(next) => failure = next,
            }
        }
    }

    /// A failure's place in the document, and its problem in words that do not show serde's types.
    fn explain(&self, failure: &ParseError) -> (Place, Problem) {
        let found = self.find(failure.path());
        let problem = problem_of(&failure.inner().to_string(), found.complete.then_some(found.node));
        let key = match &problem {
            Problem::UnknownField { field, .. } => match &found.node.value {
                Value::Table(table) if table.contains_key(field) => table.get(field).map(|f| &f.key),
                _ => found.key,
            },
            _ => None,
        };
        (key.unwrap_or(&found.node.place).clone(), problem)
    }
}

/// Takes the field out of the table that the path leads to, with or without the field itself at its end.
fn remove(json: &mut Json, path: &Path, field: &str) -> bool {
    let mut at = json;
    for segment in path {
        let here = at;
        at = match segment {
            Segment::Map { key } | Segment::Enum { variant: key } => {
                // the last segment may be the field, or not be there
                match here.get(key).is_some() && key != field {
                    true => match here.get_mut(key) {
                        Some(next) => next,
                        None => return false,
                    },
                    false => return take(here, field),
                }
            }
            Segment::Seq { index } => match here.get_mut(*index) {
                Some(next) => next,
                None => return false,
            },
            Segment::Unknown => return take(here, field),
        };
    }
    take(at, field)
}

fn take(json: &mut Json, field: &str) -> bool {
    json.as_object_mut().is_some_and(|object| object.shift_remove(field).is_some())
}

/// The same problem at every node that has it: a helper for checks that serde cannot make.
pub(crate) fn expect_table(node: &Node, errors: &Errors) {
    let problem = Problem::wrong_type("a table", node.in_words());
    errors.push(Diagnostic::new(node.place.clone(), problem));
}
