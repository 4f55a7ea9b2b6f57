//! Reads a serde type out of a node, with every error at its exact place.
use crate::diagnostic::Errors;
use crate::message::problem_of;
use crate::node::{Node, Value};
use crate::problem::Problem;
use crate::source::Place;
use crate::suggest::nearest;
use manifactor_graph::TextError;
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
            let mut removed = false;
            if let Problem::UnknownField { field, known } = &problem {
                meant.extend(nearest(field, known.iter().map(String::as_str)).map(str::to_owned));
                // a variant that is unknown would leave nothing behind
                removed = is_unknown_field(&failure) && remove(&mut json, failure.path(), field);
            }
            match &problem {
                // the unknown field's message has said what it should be called
                Problem::MissingField { field } if meant.contains(field) => {}
                _ => errors.report(place, problem),
            }
            failure = match removed.then(|| parse(json.clone())) {
                Some(Err(next)) => next,
                Some(Ok(_)) | None => return None,
            };
        }
    }

    /// A failure's place in the document, and its problem in words that do not show serde's types.
    fn explain(&self, failure: &ParseError) -> (Place, Problem) {
        let found = self.find(failure.path());
        if let Some(error) = TextError::parse(&failure.inner().to_string()) {
            // the text may be a value or a name
            let place = found.node.place_in_text(&error).or_else(|| found.node.place_of_name(&error.text));
            let place = place.unwrap_or_else(|| found.node.place.clone());
            return (place, Problem::Invalid { message: error.message, help: error.help });
        }
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

fn is_unknown_field(failure: &ParseError) -> bool {
    failure.inner().to_string().trim_start().starts_with("unknown field")
}

/// Takes the field out of the table that the path leads to, with or without the field itself at its end.
fn remove(json: &mut Json, path: &Path, field: &str) -> bool {
    let mut at = json;
    for segment in path {
        let here = at;
        let next = match segment {
            // the last segment may be the field itself
            Segment::Map { key } | Segment::Enum { variant: key } if key == field => {
                return take(here, field);
            }
            Segment::Map { key } | Segment::Enum { variant: key } => here.get_mut(key),
            Segment::Seq { index } => here.get_mut(*index),
            Segment::Unknown => None,
        };
        match next {
            Some(next) => at = next,
            None => return false,
        }
    }
    take(at, field)
}

fn take(json: &mut Json, field: &str) -> bool {
    json.as_object_mut().is_some_and(|object| object.shift_remove(field).is_some())
}
