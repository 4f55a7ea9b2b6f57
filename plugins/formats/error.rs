//! Errors in files, with their position.
use manifactor_geometry::{CoordinatesError, RotationError};
use manifactor_graph::ValueError;
use manifactor_graph::noise::NoiseError;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Maximum number of reported problems per file; the remaining ones are only counted.
const MAX_REPORTED: usize = 20;

/// The reason why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// The file could not be opened, read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The content of the file is malformed.
    #[error(transparent)]
    Malformed(#[from] Malformed),
}

/// All mistakes in the content of one file. Displayed with one problem per line.
#[derive(Debug, Clone, PartialEq)]
pub struct Malformed {
    /// Path of the file.
    pub path: PathBuf,
    /// Problems sorted by line, at most twenty.
    pub problems: Vec<BadLine>,
    /// Number of further problems.
    pub more: usize,
    /// Text of the file. Stored, because a pipe cannot be read again to show its lines.
    pub text: String,
}

/// A mistake with its line.
#[derive(Debug, Clone, PartialEq)]
pub struct BadLine {
    /// Line number from 1; 0 for the file as a whole.
    pub line: usize,
    /// The mistake.
    pub mistake: Mistake,
}

/// A mistake in a line, with the expected content.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Mistake {
    /// The line has too many or too few fields.
    #[error("expected {expected} fields ({layout}), got {found}")]
    FieldCount {
        /// Expected number of fields.
        expected: usize,
        /// Names of the expected fields.
        layout: &'static str,
        /// Number of fields found.
        found: usize,
    },
    /// A field has an invalid value.
    #[error("expected {expected}, got `{found}`")]
    Field {
        /// Description of a valid value.
        expected: &'static str,
        /// The value found.
        found: String,
    },
    /// A quaternion is not a rotation.
    #[error(transparent)]
    Rotation(#[from] RotationError),
    /// A point has invalid coordinates.
    #[error(transparent)]
    Coordinates(#[from] CoordinatesError),
    /// A value has a different type than an edge requires.
    #[error(transparent)]
    Value(#[from] ValueError),
    /// An information matrix is invalid.
    #[error("information matrix: {0}; to go on without it, choose the repair `reject` or `clamp`")]
    Noise(#[from] NoiseError),
    /// A vertex is defined twice.
    #[error("vertex {id} is defined twice, first in line {first}; remove one of the two")]
    DuplicateVertex {
        /// Number of the vertex.
        id: u64,
        /// Line of the first definition.
        first: usize,
    },
    /// A sensor is defined twice.
    #[error("PARAMS_SE3OFFSET {id} is defined twice, first in line {first}; remove one of the two")]
    DuplicateSensor {
        /// Number of the sensor.
        id: u64,
        /// Line of the first definition.
        first: usize,
    },
    /// The file contains unknown tags.
    #[error(
        "unknown tags, {lines} {}: {}; check their spelling, or leave these lines out with --lenient",
        if *lines == 1 { "line" } else { "lines" }, tags.join(", ")
    )]
    UnknownTags {
        /// Number of lines with an unknown tag.
        lines: usize,
        /// The first few unknown tags.
        tags: Vec<String>,
    },
    /// An edge connects a vertex with itself.
    #[error("the edge connects vertex {id} with itself")]
    SelfEdge {
        /// Number of the vertex.
        id: u64,
    },
    /// A number refers to an undefined vertex or sensor.
    #[error("there is no {what} {id}")]
    Unknown {
        /// Kind of the missing item.
        what: &'static str,
        /// Number of the missing item.
        id: u64,
    },
    /// A number exceeds the count in the first line.
    #[error("there is no {what} {id}: the first line says that there are {count}, counted from 0")]
    NoSuch {
        /// Kind of the missing item.
        what: &'static str,
        /// Number of the missing item.
        id: u64,
        /// Count in the first line.
        count: usize,
    },
    /// The number of items differs from the count in the first line.
    #[error("the first line asks for {expected} {what}, found {found}")]
    Count {
        /// Kind of the items.
        what: &'static str,
        /// Expected number.
        expected: usize,
        /// Number found.
        found: usize,
    },
    /// A vertex is used with a different type than it has.
    #[error("vertex {id} is a {found} (line {first}), but is used as a {expected} here")]
    VertexType {
        /// Number of the vertex.
        id: u64,
        /// Type that the edge requires.
        expected: &'static str,
        /// Type of the vertex.
        found: &'static str,
        /// Line of the definition or of the first use.
        first: usize,
    },
    /// A timestamp is equal to the previous one, or before it.
    #[error("time stamps have to increase: {found} follows {previous}")]
    NotIncreasing {
        /// Previous timestamp.
        previous: f64,
        /// Timestamp of this line.
        found: f64,
    },
    /// The file contains bytes that are not UTF-8.
    #[error("expected text in UTF-8")]
    NotText,
    /// The file contains none of the expected items.
    #[error("expected {expected}, found none{}", unknown_tags(unknown))]
    Empty {
        /// Description of the expected items.
        expected: &'static str,
        /// Unknown tags found in the file.
        unknown: Vec<String>,
    },
    /// The columns of a trajectory are separated by commas.
    #[error(
        "expected fields separated by spaces (timestamp tx ty tz qx qy qz qw), found commas: replace the commas by spaces; \
         a file in EuRoC's format also has timestamps in nanoseconds and qw before qx, so that both have to be converted"
    )]
    Commas,
    /// A row of a table cannot be read.
    #[error("{0}")]
    Row(String),
}

fn unknown_tags(tags: &[String]) -> String {
    if tags.is_empty() { String::new() } else { format!("; unknown tags: {}", tags.join(", ")) }
}

impl fmt::Display for Malformed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, problem) in self.problems.iter().enumerate() {
            let newline = if i == 0 { "" } else { "\n" };
            match problem.line {
                0 => write!(f, "{newline}{}: {}", self.path.display(), problem.mistake)?,
                line => write!(f, "{newline}{}:{line}: {}", self.path.display(), problem.mistake)?,
            }
        }
        match self.more {
            0 => Ok(()),
            more => write!(f, "\nand {more} more"),
        }
    }
}

impl std::error::Error for Malformed {}

/// Collector of problems while a file is read to its end.
pub(crate) struct ProblemList<'a> {
    path: &'a Path,
    text: &'a str,
    list: Vec<BadLine>,
    more: usize,
}

impl<'a> ProblemList<'a> {
    /// Creates a collector for a file with this text.
    pub(crate) fn of(path: &'a Path, text: &'a str) -> Self {
        Self { path, text, list: vec![], more: 0 }
    }
    pub(crate) fn push(&mut self, line: usize, mistake: impl Into<Mistake>) {
        if self.list.len() < MAX_REPORTED {
            self.list.push(BadLine { line, mistake: mistake.into() });
        } else {
            self.more += 1;
        }
    }
    /// Returns the value of a result, or records its mistake.
    pub(crate) fn ok<T>(&mut self, line: usize, result: Result<T, Mistake>) -> Option<T> {
        result.map_err(|mistake| self.push(line, mistake)).ok()
    }
    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }
    pub(crate) fn finish(self) -> Result<(), FormatError> {
        if self.is_empty() { Ok(()) } else { Err(self.into_error()) }
    }
    /// Returns the error of a file with one mistake.
    pub(crate) fn single(path: &'a Path, text: &'a str, line: usize, mistake: Mistake) -> FormatError {
        let mut problems = Self::of(path, text);
        problems.push(line, mistake);
        problems.into_error()
    }
    pub(crate) fn into_error(self) -> FormatError {
        let Self { path, text, list: mut problems, more } = self;
        // Several passes over a file may report its lines out of order.
        problems.sort_by_key(|p| p.line);
        Malformed { path: path.to_owned(), problems, more, text: text.to_owned() }.into()
    }
}

pub(crate) fn io_error(path: &Path) -> impl FnOnce(io::Error) -> FormatError + '_ {
    move |source| FormatError::Io { path: path.to_owned(), source }
}
