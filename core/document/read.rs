//! Reads a serde type out of a node, with every error at its exact place.
use crate::diagnostic::{Diagnostic, Errors};
use crate::fault::Fault;
use crate::node::{Node, Value};
use crate::read_error::ReadError;
use crate::reader::Reader;
use crate::source::Place;
use crate::suggest::nearest;
use serde::de::DeserializeOwned;

impl Node {
    /// Reads a serde type; what is wrong goes to `errors`. Serde stops at the first error, so the field that has it is taken
    /// out and reading goes on: all errors are found.
    pub fn read<T: DeserializeOwned>(&self, errors: &Errors) -> Option<T> {
        let before = errors.len();
        self.read_what_is_right(&[], errors).filter(|_| errors.len() == before)
    }

    /// The same, and what could be read without the fields that have errors: for checks that do not need those. `others` are
    /// fields of this table that are read elsewhere.
    pub fn read_what_is_right<T: DeserializeOwned>(&self, others: &[String], errors: &Errors) -> Option<T> {
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
            let is_told = rest.explains(&place, &fault);
            let goes_on = rest.cut(&place, &fault, failure.is_unread_field());
            if !is_told {
                errors.report(place, fault);
            }
            let goes_on = goes_on && errors.len() < before + MOST;
            if errors.len() >= before + MOST {
                errors
                    .report(self.place.clone(), Fault::invalid(format!("has more errors than these {MOST}")));
            }
            failure = match goes_on.then(|| rest.node.try_read::<T>()) {
                Some(Err(next)) => next,
                Some(Ok(value)) => return Some(value),
                None => return None,
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
        Diagnostic::new(self.place.clone(), Fault::NotFinite { text })
    }
}

/// Errors of one type that are looked for: each takes another reading.
const MOST: usize = 100;

/// What is left of a node once the fields with errors are taken out of it.
struct Rest {
    node: Node,
    /// Tables and arrays from which something was taken, directly or within; and the field by which.
    cut: Vec<(Place, String)>,
    /// What unknown fields should have been called.
    meant: Vec<String>,
}

impl Rest {
    /// Returns whether an error only says that something is missing which was taken out, or was called otherwise.
    fn explains(&self, place: &Place, fault: &Fault) -> bool {
        let is_cut =
            |by: &str| self.cut.iter().any(|(at, field)| at == place && (by.is_empty() || by == field));
        match fault {
            Fault::MissingField { field } => self.meant.contains(field) || is_cut(field),
            Fault::UnknownField { .. } => false,
            _ => is_cut(""),
        }
    }

    /// Takes out the field that an error is of; whether there is one. `unread`: its name is there, and nothing reads it.
    fn cut(&mut self, place: &Place, fault: &Fault, unread: bool) -> bool {
        let Fault::UnknownField { field, known } = fault else {
            return cut_around(&mut self.node, place, &mut self.cut) == Cut::Done;
        };
        self.meant.extend(nearest(field, known.iter().map(String::as_str)).map(str::to_owned));
        match unread {
            true => cut_named(&mut self.node, field, place),
            // the name of a variant: without it, nothing is left of the value
            false => cut_around(&mut self.node, place, &mut self.cut) == Cut::Done,
        }
    }
}

/// Takes out the field whose name is written there; whether it was found.
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
    /// The place is not of this node.
    Elsewhere,
    /// It is this node that has to go.
    This,
    /// It is gone.
    Done,
}

/// Takes out the innermost field, or table in an array, that a place is of.
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

    /// How many errors a list is told to have in which each size is a text.
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
    fn all_errors_are_told_up_to_a_bound() {
        assert_eq!(errors_of(MOST - 1), MOST - 1);
        // each takes a reading of all: without a bound, a large file of errors would take hours. One says that there are more
        assert_eq!(errors_of(3 * MOST), MOST + 1);
    }
}
