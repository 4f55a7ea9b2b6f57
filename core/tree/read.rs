//! Reads a serde type out of a node, with every error at its exact place.
use crate::diagnostic::{Diagnostic, Errors};
use crate::node::{Node, Value};
use crate::problem::Problem;
use crate::read_error::ReadError;
use crate::reader::Reader;
use crate::source::Place;
use crate::suggest::nearest;
use serde::de::DeserializeOwned;

impl Node {
    /// Reads a serde type; what is wrong goes to `errors`. Serde stops at the first error; an unknown field is taken out
    /// and reading goes on, so that all of them are found.
    pub fn read<T: DeserializeOwned>(&self, errors: &Errors) -> Option<T> {
        let before = errors.len();
        self.report_not_finite(errors);
        if errors.len() > before {
            return None;
        }
        let mut failure = match self.try_read() {
            Ok(value) => return Some(value),
            Err(failure) => failure,
        };
        let mut rest = self.clone();
        let mut meant: Vec<String> = Vec::new();
        loop {
            let (problem, place) = (failure.problem(), failure.place().unwrap_or(&self.place).clone());
            let mut removed = false;
            if let Problem::UnknownField { field, known } = &problem {
                meant.extend(nearest(field, known.iter().map(String::as_str)).map(str::to_owned));
                // a variant that is unknown would leave nothing behind
                removed = failure.is_unread_field() && rest.remove(field, &place);
            }
            match &problem {
                // the unknown field's message has said what it should be called
                Problem::MissingField { field } if meant.contains(field) => {}
                _ => errors.report(place, problem),
            }
            failure = match removed.then(|| rest.try_read::<T>()) {
                Some(Err(next)) => next,
                Some(Ok(_)) | None => return None,
            };
        }
    }

    /// Reads a serde type, up to the first error.
    ///
    /// # Errors
    /// Whatever serde finds, at its place.
    pub fn try_read<T: DeserializeOwned>(&self) -> Result<T, ReadError> {
        T::deserialize(Reader::new(self)).map_err(|error| error.at(self))
    }

    /// Every number that is infinite, or none.
    fn report_not_finite(&self, errors: &Errors) {
        match &self.value {
            Value::Float(value) if !value.is_finite() => errors.push(self.not_finite(*value)),
            Value::Array(items) => items.iter().for_each(|item| item.report_not_finite(errors)),
            Value::Table(table) => table.values().for_each(|field| field.node.report_not_finite(errors)),
            _ => {}
        }
    }

    pub(crate) fn not_finite(&self, value: f64) -> Diagnostic {
        let text = match self.place.text() {
            "" => value.to_string(),
            text => text.to_owned(),
        };
        Diagnostic::new(self.place.clone(), Problem::NotFinite { text })
    }

    /// Takes out the field whose name is written there; whether it was found.
    fn remove(&mut self, field: &str, key: &Place) -> bool {
        match &mut self.value {
            Value::Array(items) => items.iter_mut().any(|item| item.remove(field, key)),
            Value::Table(table) => match table.get(field) {
                Some(found) if found.key == *key => table.shift_remove(field).is_some(),
                _ => table.values_mut().any(|inner| inner.node.remove(field, key)),
            },
            _ => false,
        }
    }
}
