//! What can be wrong with a document, and what to do about it.
use crate::suggest::{advice, list};

/// What is wrong at a place. Its text says what and what was expected; [`help`](Fault::help) says what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Fault {
    /// The text is not of its format.
    #[error("not valid {format}: {message}")]
    Syntax {
        /// The format's name.
        format: &'static str,
        /// The parser's words.
        message: String,
    },
    /// The file's extension says no format that is known.
    #[error("the extension of this file names no known format")]
    UnknownFormat,
    /// The file is not there, or could not be read; what it says does not matter.
    #[error("cannot be read: {0}")]
    Unreadable(String),
    /// The text is longer than any document should be.
    #[error("{bytes} bytes are more than the {limit} that a document may have")]
    TooLarge {
        /// Its length.
        bytes: u64,
        /// The largest length.
        limit: u64,
    },
    /// Tables and arrays within one another, too many.
    #[error("nested more than {limit} levels deep")]
    TooDeep {
        /// The greatest depth.
        limit: usize,
    },
    /// YAML aliases that stand for more values than a document should have.
    #[error("the aliases stand for more than {limit} values")]
    TooManyAliases {
        /// The greatest number of values.
        limit: usize,
    },
    /// A name is given twice where each may be given once.
    #[error("{what} `{name}` is given twice")]
    Duplicate {
        /// `key`, `variable`, …
        what: String,
        /// The name.
        name: String,
    },
    /// A field that no type reads.
    #[error("unknown field `{field}`")]
    UnknownField {
        /// The field.
        field: String,
        /// The fields that are read here.
        known: Vec<String>,
    },
    /// A name that stands for nothing.
    #[error("unknown {what} `{name}`")]
    UnknownName {
        /// `factor`, `loss`, `variable`, …
        what: String,
        /// The name.
        name: String,
        /// The names that exist.
        known: Vec<String>,
    },
    /// A field that has to be there is not.
    #[error("missing field `{field}`")]
    MissingField {
        /// The field.
        field: String,
    },
    /// A value of another type than the one expected.
    #[error("expected {expected}, found {found}")]
    WrongType {
        /// What was expected, in words.
        expected: String,
        /// What stands there, in words.
        found: String,
    },
    /// An infinity, or not a number at all.
    #[error("`{text}` is not a finite number")]
    NotFinite {
        /// What is written.
        text: String,
    },
    /// Anything else, in the words of the type that was read or of the caller.
    #[error("{message}")]
    Invalid {
        /// What is wrong.
        message: String,
        /// What to do about it.
        help: Option<String>,
    },
}

impl Fault {
    /// A problem in the caller's own words.
    pub fn invalid(message: impl Into<String>) -> Self {
        Fault::Invalid { message: message.into(), help: None }
    }

    /// A problem in the caller's own words, and what to do about it.
    pub fn with_help(message: impl Into<String>, help: impl Into<String>) -> Self {
        Fault::Invalid { message: message.into(), help: Some(help.into()) }
    }

    /// A value of another type than the one expected.
    pub fn wrong_type(expected: impl Into<String>, found: impl Into<String>) -> Self {
        Fault::WrongType { expected: expected.into(), found: found.into() }
    }

    /// What to do about it, where that can be said.
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

/// `` `a`, `b` and `c` ``, for messages that name several things.
pub fn quoted_list(names: &[String]) -> String {
    list(names)
}
