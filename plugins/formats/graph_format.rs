//! The formats of files that hold a graph, by name: one file of code is one format.
//!
//! ```
//! use manifactor_formats::{FormatError, GraphFormat, GraphRead, Reading, register_graph_format};
//! use manifactor_graph::{Graph, Values};
//! use std::path::Path;
//!
//! fn parse(text: &str, path: &Path, reading: Reading) -> Result<GraphRead, FormatError> {
//!     # let _ = (text, path, reading);
//!     Ok(GraphRead::default())
//! }
//! register_graph_format!(GraphFormat {
//!     name: "nothing",
//!     extensions: &["nothing"],
//!     begins: |text| text.starts_with("nothing"),
//!     parse,
//!     format: Some(|_graph, _values| ("nothing\n".to_owned(), vec![])),
//! });
//!
//! fn main() {
//!     let format = GraphFormat::of(Path::new("a.nothing"), "").map(|format| format.name);
//!     assert_eq!(format, Some("nothing"));
//! }
//! ```
use crate::error::FormatError;
use manifactor_graph::{Graph, Values};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A format of files that hold a graph. [`register_graph_format!`](crate::register_graph_format) enters it.
#[derive(Debug, Clone, Copy)]
pub struct GraphFormat {
    /// What it is called, in messages.
    pub name: &'static str,
    /// Extensions of its files, in lower case. The first is the usual one.
    pub extensions: &'static [&'static str],
    /// Whether a text is in this format by how it begins, for files whose extension tells nothing.
    pub begins: fn(&str) -> bool,
    /// Reads a text; the path is what errors name.
    pub parse: fn(&str, &Path, Reading) -> Result<GraphRead, FormatError>,
    /// Writes a graph. `None`: the format is only read.
    pub format: Option<GraphWriter>,
}
inventory::collect!(GraphFormat);

/// The text of a graph with these values, and in words what the format cannot express.
pub type GraphWriter = fn(&Graph, &Values) -> (String, Vec<String>);

/// What to do where a file leaves a choice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reading {
    /// For information matrices that are not positive definite.
    pub repair: Repair,
    /// Whether to hold what nothing in the file fixes: a pose, or a scale.
    pub anchor: bool,
    /// Whether to leave out lines that the format does not know.
    pub lenient: bool,
}

/// What to do with an information matrix that is not positive definite.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Repair {
    /// Say so, with its line.
    #[default]
    Error,
    /// Leave its edge out.
    Reject,
    /// Raise its eigenvalues to 1e-9 of the largest; leave the edge out where none is above zero.
    Clamp,
}

/// A graph from a file.
#[derive(Debug, Clone, Default)]
pub struct GraphRead {
    /// Factors; held variables.
    pub graph: Graph,
    /// Initial values of all variables.
    pub values: Values,
    /// In words, what the reader had to decide.
    pub notes: Vec<String>,
}

impl GraphFormat {
    /// All that are linked, by name.
    pub fn all() -> Vec<&'static Self> {
        let mut all: Vec<_> = inventory::iter::<Self>.into_iter().collect();
        all.sort_by_key(|format| format.name);
        all
    }

    /// The format of a file by its extension.
    pub fn of_path(path: &Path) -> Option<&'static Self> {
        let extension = path.extension()?.to_str()?.to_lowercase();
        Self::all().into_iter().find(|format| format.extensions.contains(&extension.as_str()))
    }

    /// The format of a file by its extension, or else by how its text begins.
    pub fn of(path: &Path, text: &str) -> Option<&'static Self> {
        Self::of_path(path).or_else(|| Self::all().into_iter().find(|format| (format.begins)(text)))
    }
}

/// Enters a [`GraphFormat`] among those that are linked.
#[macro_export]
macro_rules! register_graph_format {
    ($format:expr) => {
        $crate::__private::inventory::submit! { $format }
    };
}
