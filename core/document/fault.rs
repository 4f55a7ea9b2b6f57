//! Faults of documents, with remedies.
use crate::suggest::{advice, list};

/// A fault at a position. Its text names the fault and the expected value; [`help`](Fault::help) returns the
/// remedy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The text violates the syntax of its format.
    #[error("not valid {format}: {message}")]
    Syntax {
        /// Name of the format.
        format: &'static str,
        /// Message of the parser.
        message: String,
    },
    /// The extension of the file is not of a known format.
    #[error("the extension of this file names no known format")]
    UnknownFormat,
    /// The file does not exist or cannot be read.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// The text is longer than the limit for documents.
    #[error("{bytes} bytes are more than the {limit} that a document may have")]
    TooLarge {
        /// Length of the text.
        bytes: u64,
        /// Largest allowed length.
        limit: u64,
    },
    /// Tables and arrays are nested too deeply.
    #[error("nested more than {limit} levels deep")]
    TooDeep {
        /// Largest allowed depth.
        limit: usize,
    },
    /// YAML aliases expand to too many values.
    #[error("the aliases stand for more than {limit} values")]
    TooManyAliases {
        /// Largest allowed number of values.
        limit: usize,
    },
    /// A name that must be unique is given twice.
    #[error("{what} `{name}` is given twice")]
    Duplicate {
        /// Kind of the name: `key`, `variable`, …
        what: String,
        /// The name.
        name: String,
    },
    /// A field that no type reads.
    #[error("unknown field `{field}`")]
    UnknownField {
        /// The field.
        field: String,
        /// The possible fields.
        known: Vec<String>,
    },
    /// A name that does not exist.
    #[error("unknown {what} `{name}`")]
    UnknownName {
        /// Kind of the name: `factor`, `loss`, `variable`, …
        what: String,
        /// The name.
        name: String,
        /// The existing names.
        known: Vec<String>,
    },
    /// A required field is missing.
    #[error("missing field `{field}`")]
    MissingField {
        /// The field.
        field: String,
    },
    /// A value of an unexpected type.
    #[error("expected {expected}, found {found}")]
    WrongType {
        /// Expected type in words.
        expected: String,
        /// Value in the document in words.
        found: String,
    },
    /// A number that is infinite or NaN.
    #[error("`{text}` is not a finite number")]
    NotFinite {
        /// Text of the number.
        text: String,
    },
    /// Any further error, with a message of the type or of the caller.
    #[error("{message}")]
    Invalid {
        /// The error.
        message: String,
        /// The remedy.
        help: Option<String>,
    },
}

impl Fault {
    /// Creates a fault from a message.
    pub fn invalid(message: impl Into<String>) -> Self {
        Fault::Invalid { message: message.into(), help: None }
    }

    /// Creates a fault from a message and a remedy.
    pub fn with_help(message: impl Into<String>, help: impl Into<String>) -> Self {
        Fault::Invalid { message: message.into(), help: Some(help.into()) }
    }

    /// Creates the fault for a value of an unexpected type.
    pub fn wrong_type(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Fault::WrongType { expected: expected.into(), found: found.into() }
    }

    /// Returns the remedy, if there is one.
    pub fn help(&self) -> Option<String> {
        match self {
            Fault::UnknownFormat => Some("use .toml, .json, .yaml or .yml".into()),
            Fault::UnknownField { known, .. } if known.is_empty() => Some("there are no fields here".into()),
            Fault::UnknownField { field: name, known } | Fault::UnknownName { name, known, .. } => {
                advice(name, known)
            }
            Fault::Duplicate { .. } => Some("remove or rename one of them".into()),
            Fault::Invalid { help, .. } => help.clone(),
            _ => None,
        }
    }
}

/// Formats names for messages: `` `a`, `b` and `c` ``.
pub fn quoted_list(names: &[String]) -> String {
    list(names)
}
