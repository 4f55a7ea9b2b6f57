//! Reading of a serde type from a node, with an exact position for each error.
use crate::diagnostic::{Diagnostic, Errors};
use crate::fault::Fault;
use crate::node::{Node, Value};
use crate::read_error::ReadError;
use crate::reader::Reader;
use crate::source::Place;
use crate::suggest::nearest;
use serde::de::DeserializeOwned;

impl Node {
    /// Reads a serde type and adds all errors to `errors`. Serde stops at the first error, so this function
    /// removes the field with the error and reads again.
    pub fn read<T: DeserializeOwned>(&self, errors: &Errors) -> Option<T> {
        let before = errors.len();
        self.read_partial(&[], errors).filter(|_| errors.len() == before)
    }

    /// Reads a serde type like [`read`](Self::read), but returns a value even if fields with errors had to be
    /// removed, for checks that do not need them. `others` are fields of this table that are read elsewhere.
    pub fn read_partial<T: DeserializeOwned>(&self, others: &[String], errors: &Errors) -> Option<T> {
        let before = errors.len();
        self.report_not_finite(errors);
        if errors.len() > before {
            return None;
        }
        let mut failure = match self.try_read() {
            Ok(value) => return Some(value),
            Err(failure) => failure,
        };
        let mut rest = Rest { node: self.clone(), cut: Vec::new(), meant: Vec::new() };
        loop {
            let place = failure.place().unwrap_or(&self.place).clone();
            let mut fault = failure.fault();
            if let (Fault::UnknownField { field, known }, Value::Table(table)) = (&mut fault, &self.value)
                && table.get(field).is_some_and(|found| found.key == place)
            {
                known.extend_from_slice(others);
            }
            let is_explained = rest.explains(&place, &fault);
            let continues = rest.cut(&place, &fault, failure.is_unread_field());
            if !is_explained {
                errors.report(place, fault);
            }
            let continues = continues && errors.len() < before + MAX_ERRORS;
            if errors.len() >= before + MAX_ERRORS {
                errors.report(
                    self.place.clone(),
                    Fault::invalid(format!("has more errors than these {MAX_ERRORS}")),
                );
            }
            failure = match continues.then(|| rest.node.try_read::<T>()) {
                Some(Err(next)) => next,
                Some(Ok(value)) => return Some(value),
                None => return None,
            };
        }
    }

    /// Reads a serde type and stops at the first error.
    ///
    /// # Errors
    /// The error of serde, with its position.
    pub fn try_read<T: DeserializeOwned>(&self) -> Result<T, ReadError> {
        T::deserialize(Reader::new(self)).map_err(|error| error.at(self))
    }

    /// Reports each number that is infinite or NaN.
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
        Diagnostic::new(self.place.clone(), Fault::NotFinite { text })
    }
}

/// Largest number of errors per type. Each one costs a further reading.
const MAX_ERRORS: usize = 100;

/// The remaining node after fields with errors were removed.
struct Rest {
    node: Node,
    /// Tables and arrays that lost a part, directly or below, each with the field that leads to it.
    cut: Vec<(Place, String)>,
    /// Probable names of unknown fields.
    meant: Vec<String>,
}

impl Rest {
    /// Returns whether an error is only a consequence of a removed field or a misspelled name.
    fn explains(&self, place: &Place, fault: &Fault) -> bool {
        let is_cut =
            |by: &str| self.cut.iter().any(|(at, field)| at == place && (by.is_empty() || by == field));
        match fault {
            Fault::MissingField { field } => self.meant.contains(field) || is_cut(field),
            Fault::UnknownField { .. } => false,
            _ => is_cut(""),
        }
    }

    /// Removes the field that has an error. Returns whether it was found. `unread` is true for a field that
    /// no type reads.
    fn cut(&mut self, place: &Place, fault: &Fault, unread: bool) -> bool {
        let Fault::UnknownField { field, known } = fault else {
            return cut_around(&mut self.node, place, &mut self.cut) == Cut::Done;
        };
        self.meant.extend(nearest(field, known.iter().map(String::as_str)).map(str::to_owned));
        match unread {
            true => cut_named(&mut self.node, field, place),
            // the field is the name of a variant: without it, no value remains
            false => cut_around(&mut self.node, place, &mut self.cut) == Cut::Done,
        }
    }
}

/// Removes the field whose name is at this position. Returns whether it was found.
fn cut_named(node: &mut Node, field: &str, key: &Place) -> bool {
    match &mut node.value {
        Value::Array(items) => items.iter_mut().any(|item| cut_named(item, field, key)),
        Value::Table(table) => match table.get(field) {
            Some(found) if found.key == *key => table.shift_remove(field).is_some(),
            _ => table.values_mut().any(|inner| cut_named(&mut inner.node, field, key)),
        },
        _ => false,
    }
}

#[derive(PartialEq)]
enum Cut {
    /// The position is not in this node.
    Elsewhere,
    /// This node has to be removed.
    This,
    /// The part is removed.
    Done,
}

/// Removes the innermost field that contains a position, or the innermost table in an array.
fn cut_around(node: &mut Node, place: &Place, cut: &mut Vec<(Place, String)>) -> Cut {
    let (mut through, mut found) = (String::new(), Cut::Elsewhere);
    match &mut node.value {
        Value::Array(items) => {
            for i in 0..items.len() {
                let Some(item) = items.get_mut(i) else { break };
                found = cut_around(item, place, cut);
                if found == Cut::This && matches!(item.value, Value::Table(_)) {
                    items.remove(i);
                    found = Cut::Done;
                }
                if found != Cut::Elsewhere {
                    break;
                }
            }
        }
        Value::Table(table) => {
            for (name, field) in table.iter_mut() {
                found = match field.key == *place {
                    true => Cut::This,
                    false => cut_around(&mut field.node, place, cut),
                };
                if found != Cut::Elsewhere {
                    through.clone_from(name);
                    break;
                }
            }
            if found == Cut::This {
                table.shift_remove(&through);
                found = Cut::Done;
            }
        }
        _ => {}
    }
    match found {
        Cut::Done => cut.push((node.place.clone(), through)),
        Cut::Elsewhere if node.place.contains(place) => return Cut::This,
        Cut::Elsewhere | Cut::This => {}
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::{Field, Table};
    use crate::source::SourceText;

    #[derive(Debug, PartialEq, serde::Deserialize)]
    struct Sized {
        size: f64,
    }

    /// Returns the number of errors that are reported for a list with a string for each size.
    fn errors_of(count: usize) -> usize {
        let source = SourceText::new("sizes", "x".repeat(2 * count));
        let item = |at: usize| {
            let (key, place) = (source.place(2 * at..2 * at + 1), source.place(2 * at + 1..2 * at + 2));
            let mut table = Table::default();
            table.insert("size".into(), Field { key, node: Node::new(place, Value::String("x".into())) });
            Node::new(source.place(2 * at..2 * at + 2), Value::Table(table))
        };
        let node = Node::new(source.place(0..2 * count), Value::Array((0..count).map(item).collect()));
        let errors = Errors::new();
        assert_eq!(node.read::<Vec<Sized>>(&errors), None);
        errors.len()
    }

    #[test]
    fn all_errors_are_reported_up_to_a_bound() {
        assert_eq!(errors_of(MAX_ERRORS - 1), MAX_ERRORS - 1);
        // each error costs a reading of everything; without a limit, a large file of errors would take hours.
        // The last error reports that there are more
        assert_eq!(errors_of(3 * MAX_ERRORS), MAX_ERRORS + 1);
    }
}
