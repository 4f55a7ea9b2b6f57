//! Registry of graph file formats by name; each format is one source file.
//!
//! ```
//! use manifactor_formats::{
//!     FormatError, GraphFormat, GraphRead, GraphText, ReadOptions, register_graph_format,
//! };
//! use manifactor_graph::{Graph, Values};
//! use std::path::{Path, PathBuf};
//!
//! fn parse(text: &str, path: &Path, options: ReadOptions) -> Result<GraphRead, FormatError> {
//!     # let _ = (text, path, options);
//!     Ok(GraphRead::default())
//! }
//! register_graph_format!(GraphFormat {
//!     name: "nothing",
//!     extensions: &["nothing"],
//!     folder: None,
//!     begins: |text| text.starts_with("nothing"),
//!     parse,
//!     format: Some(|_graph, _values, _like| Ok(GraphText::file("nothing\n".to_owned(), vec![]))),
//! });
//!
//! fn main() {
//!     let format = GraphFormat::detect(Path::new("a.nothing"), "").map(|format| format.name);
//!     assert_eq!(format, Some("nothing"));
//! }
//! ```
use crate::error::FormatError;
use manifactor_graph::{Graph, Values};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A file format for graphs, registered with [`register_graph_format!`](crate::register_graph_format).
#[derive(Debug, Clone, Copy)]
pub struct GraphFormat {
    /// Name in messages.
    pub name: &'static str,
    /// File extensions, in lower case. The first is the default.
    pub extensions: &'static [&'static str],
    /// Name of the file that is parsed, if a graph is a folder of files. `None` if it is one file.
    pub folder: Option<&'static str>,
    /// Detects the format from the beginning of a text, for files with an unknown extension.
    pub begins: fn(&str) -> bool,
    /// Parses a text; the path is used only in errors.
    pub parse: fn(&str, &Path, ReadOptions) -> Result<GraphRead, FormatError>,
    /// Formats a graph as text. `None` for a read-only format.
    pub format: Option<GraphWriter>,
}
inventory::collect!(GraphFormat);

/// Writer of a format: returns the text of a graph with its values. The path is that of the file or folder from which
/// the graph was read, if any: a format can take from it what a graph does not have.
pub type GraphWriter = fn(&Graph, &Values, Option<&Path>) -> Result<GraphText, FormatError>;

/// A graph as text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GraphText {
    /// Texts of the files. Each has a name in a folder; `None` for the only file.
    pub files: Vec<(Option<&'static str>, String)>,
    /// Notes about the parts that the format cannot express.
    pub notes: Vec<String>,
}

impl GraphText {
    /// Makes the text of a single file.
    pub fn file(text: String, notes: Vec<String>) -> Self {
        Self { files: vec![(None, text)], notes }
    }

    /// Returns the path of each file of a graph at `path`, with its text.
    pub fn at<'a>(&'a self, path: &'a Path) -> impl Iterator<Item = (PathBuf, &'a str)> {
        self.files.iter().map(move |(name, text)| {
            (name.map_or_else(|| path.to_owned(), |name| path.join(name)), text.as_str())
        })
    }
}

/// Options for cases that a file leaves open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadOptions {
    /// Treatment of information matrices that are not positive definite.
    pub repair: InformationRepair,
    /// Whether to hold a pose or a scale if the file does not fix the gauge.
    pub anchor: bool,
    /// Whether to skip lines that the format does not know.
    pub lenient: bool,
}

/// Treatment of an information matrix that is not positive definite.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Repair")]
pub enum InformationRepair {
    /// Report an error with its line.
    #[default]
    Error,
    /// Omit the edge.
    Reject,
    /// Raise the eigenvalues to 1e-9 of the largest; omit the edge if no eigenvalue is positive.
    Clamp,
}

/// A graph read from a file.
#[derive(Debug, Clone, Default)]
pub struct GraphRead {
    /// Factors and held variables.
    pub graph: Graph,
    /// Initial values of all variables.
    pub values: Values,
    /// Notes about assumptions that the reader made.
    pub notes: Vec<String>,
}

impl GraphFormat {
    /// Returns all linked formats, sorted by name.
    pub fn all() -> Vec<&'static Self> {
        let mut all: Vec<_> = inventory::iter::<Self>.into_iter().collect();
        all.sort_by_key(|format| format.name);
        all
    }

    /// Returns the format with the file's extension.
    pub fn by_extension(path: &Path) -> Option<&'static Self> {
        let extension = path.extension()?.to_str()?.to_lowercase();
        Self::all().into_iter().find(|format| format.extensions.contains(&extension.as_str()))
    }

    /// Returns the format of a folder, and the path of the file to parse. `None` if no format has such a file, or if
    /// `path` is no folder.
    pub fn of_folder(path: &Path) -> Option<(&'static Self, PathBuf)> {
        let file = |format: &'static Self| Some((format, path.join(format.folder?)));
        Self::all().into_iter().filter_map(file).find(|(_, file)| file.is_file())
    }

    /// Returns the format in which a graph is written to a path: that of its extension, or for a path without one, that
    /// of a folder.
    pub fn of_destination(path: &Path) -> Option<&'static Self> {
        match path.extension() {
            None => Self::all().into_iter().find(|format| format.folder.is_some()),
            Some(_) => Self::by_extension(path),
        }
    }

    /// Returns the format with the file's extension, otherwise the format that matches the beginning of the
    /// text.
    pub fn detect(path: &Path, text: &str) -> Option<&'static Self> {
        Self::by_extension(path).or_else(|| Self::all().into_iter().find(|format| (format.begins)(text)))
    }
}

/// Registers a [`GraphFormat`].
#[macro_export]
macro_rules! register_graph_format {
    ($format:expr) => {
        $crate::__private::inventory::submit! { $format }
    };
}
