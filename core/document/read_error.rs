//! Errors of serde as faults with positions, in terms of documents instead of Rust.
use crate::fault::Fault;
use crate::node::{Node, Value};
use crate::source::Place;
use crate::text_error::TextError;
use serde::de::{Error, Expected, Unexpected};
use std::fmt;

/// Error of reading a type, with its position.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadError(Box<Inner>);

#[derive(Debug, Clone, PartialEq)]
enum Inner {
    /// An error without a position so far.
    Unplaced(SerdeError),
    Placed {
        place: Place,
        fault: Fault,
        unread: bool,
    },
}

/// An error of serde before its node is known.
#[derive(Debug, Clone, PartialEq)]
enum SerdeError {
    Type { expected: String, found: String },
    Length { expected: String, found: usize },
    Variant { name: String, known: Vec<String> },
    Field { name: String, known: Vec<String> },
    Missing { name: String },
    Text(TextError),
    Message(String),
}

impl ReadError {
    /// Creates an error from a fault and its position.
    pub fn new(place: Place, fault: Fault) -> Self {
        Self(Box::new(Inner::Placed { place, fault, unread: false }))
    }

    /// Returns the fault.
    pub fn fault(&self) -> Fault {
        match &*self.0 {
            Inner::Unplaced(what) => what.fault(None),
            Inner::Placed { fault, .. } => fault.clone(),
        }
    }

    /// Returns the position, if it is known.
    pub fn place(&self) -> Option<&Place> {
        match &*self.0 {
            Inner::Unplaced(_) => None,
            Inner::Placed { place, .. } => Some(place),
        }
    }

    /// Returns whether the error is a field that no type reads. Reading can go on without it.
    pub(crate) fn is_unread_field(&self) -> bool {
        matches!(&*self.0, Inner::Placed { unread: true, .. })
    }

    /// Adds the position of this node, unless the error already has a position.
    #[must_use]
    pub fn at(self, node: &Node) -> Self {
        let Inner::Unplaced(what) = &*self.0 else { return self };
        let unread = matches!(what, SerdeError::Field { .. });
        Self(Box::new(Inner::Placed { place: what.place(node), fault: what.fault(Some(node)), unread }))
    }

    fn unplaced(what: SerdeError) -> Self {
        Self(Box::new(Inner::Unplaced(what)))
    }
}

impl SerdeError {
    fn place(&self, node: &Node) -> Place {
        let found = match (self, &node.value) {
            (Self::Field { name, .. } | Self::Variant { name, .. }, Value::Table(table)) => {
                table.get(name).map(|field| field.key.clone())
            }
            // the text may be a value or a name
            (Self::Text(error), _) => node.place_in_text(error).or_else(|| node.place_of_name(&error.text)),
            _ => None,
        };
        found.unwrap_or_else(|| node.place.clone())
    }

    fn fault(&self, node: Option<&Node>) -> Fault {
        let is_table = node.is_some_and(|node| matches!(node.value, Value::Table(_)));
        match self.clone() {
            Self::Type { expected, found } => {
                let found = node.map_or(found, Node::in_words);
                Fault::WrongType { expected: in_words(&expected), found }
            }
            Self::Length { expected, found } => {
                let found = if found == 1 { "1 element".to_owned() } else { format!("{found} elements") };
                Fault::WrongType { expected: in_words(&expected), found }
            }
            // `{ sigma = 1 }` names its variant as a field
            Self::Variant { name, known } if is_table => Fault::UnknownField { field: name, known },
            Self::Variant { name, known } => Fault::UnknownName { what: "value".into(), name, known },
            Self::Field { name, known } => Fault::UnknownField { field: name, known },
            Self::Missing { name } => Fault::MissingField { field: name },
            Self::Text(error) => Fault::Invalid { message: error.message, help: error.help },
            Self::Message(message) if message.starts_with("data did not match any variant of untagged") => {
                let found = node.map_or_else(|| "something else".to_owned(), Node::in_words);
                Fault::invalid(format!("{found} has none of the forms that are possible here"))
            }
            Self::Message(message) => Fault::invalid(message),
        }
    }
}

impl Error for ReadError {
    fn custom<T: fmt::Display>(message: T) -> Self {
        let message = message.to_string();
        let line = message.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
        Self::unplaced(SerdeError::Message(line.trim().to_owned()))
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::unplaced(SerdeError::Type { expected: expected.to_string(), found: found.to_string() })
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(found: usize, expected: &dyn Expected) -> Self {
        Self::unplaced(SerdeError::Length { expected: expected.to_string(), found })
    }

    fn unknown_variant(name: &str, known: &'static [&'static str]) -> Self {
        Self::unplaced(SerdeError::Variant { name: name.to_owned(), known: owned(known) })
    }

    fn unknown_field(name: &str, known: &'static [&'static str]) -> Self {
        Self::unplaced(SerdeError::Field { name: name.to_owned(), known: owned(known) })
    }

    fn missing_field(name: &'static str) -> Self {
        Self::unplaced(SerdeError::Missing { name: name.to_owned() })
    }
}

/// Converts a fault within a string of the node.
impl From<TextError> for ReadError {
    fn from(error: TextError) -> Self {
        Self::unplaced(SerdeError::Text(error))
    }
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Inner::Unplaced(SerdeError::Text(error)) = &*self.0 {
            return error.fmt(f);
        }
        let fault = self.fault();
        write!(f, "{fault}")?;
        fault.help().map_or(Ok(()), |help| write!(f, " ({help})"))
    }
}

impl std::error::Error for ReadError {}

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// Translates the expectation of serde into terms of documents.
fn in_words(expected: &str) -> String {
    let words = match expected {
        "f64" | "f32" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, 0 or more",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "a nonzero u32" | "a nonzero u64" | "a nonzero usize" => "a whole number, 1 or more",
        "a boolean" => "true or false",
        "a string" | "a borrowed string" | "path string" => "a text",
        "a sequence" => "an array",
        "a map" => "a table",
        "fewer elements in array" => "fewer elements",
        _ => "",
    };
    match words {
        "" if expected.starts_with("struct ") => "a table".into(),
        "" if expected.starts_with("tuple ") || expected.starts_with("a tuple") => match size(expected) {
            Some(size) => format!("an array of {size}"),
            None => "an array".into(),
        },
        "" if expected.starts_with("an array of length ") => {
            format!("an array of {}", size(expected).unwrap_or("some size"))
        }
        "" if expected.contains(" enum ") || expected.starts_with("enum ") => "a name or a table".into(),
        "" => expected.to_owned(),
        words => words.to_owned(),
    }
}

/// Returns `3` for `an array of length 3`, `a tuple of size 3`, `tuple struct Box with 3 elements`.
fn size(expected: &str) -> Option<&str> {
    expected.split_whitespace().find(|word| word.bytes().all(|b| b.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_and_their_neighbours_are_told() {
        let fault = ReadError::unknown_field("sigam", &["sigma", "loss"]).fault();
        assert_eq!(fault.to_string(), "unknown field `sigam`");
        assert_eq!(fault.help().unwrap(), "did you mean `sigma`? there are `sigma` and `loss`");
        let fault = ReadError::unknown_field("x", &[]).fault();
        assert_eq!(fault.help().unwrap(), "there are no fields here");
    }

    #[test]
    fn types_are_said_in_words() {
        let wrong = |expected| ReadError::invalid_type(Unexpected::Map, &expected).fault().to_string();
        assert_eq!(wrong("f64"), "expected a number, found map");
        assert_eq!(wrong("a tuple of size 4"), "expected an array of 4, found map");
        let short = ReadError::invalid_length(2, &"an array of length 3").fault();
        assert_eq!(short.to_string(), "expected an array of 3, found 2 elements");
        assert_eq!(ReadError::custom("sigma has to be positive\n\n").to_string(), "sigma has to be positive");
    }
}
