//! What can be wrong with a file, and where.
use manifactor_geometry::{NoCoordinates, NotARotation};
use manifactor_graph::ValueError;
use manifactor_graph::noise::NoiseError;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// How many problems of one file are told; the rest is counted.
const TOLD: usize = 20;

/// Why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// The file could not be opened, read or written.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Its content is not what it should be.
    #[error(transparent)]
    Malformed(#[from] Malformed),
}

/// Everything that is wrong with the content of one file. Displayed one problem a line.
#[derive(Debug, Clone, PartialEq)]
pub struct Malformed {
    /// The file.
    pub path: PathBuf,
    /// By line, at most twenty.
    pub problems: Vec<BadLine>,
    /// How many more there are.
    pub more: usize,
    /// What was read: a pipe cannot be read again to show its lines.
    pub text: String,
}

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct BadLine {
    /// The line, from 1; 0 where it is the file as a whole.
    pub line: usize,
    /// What is wrong with it.
    pub mistake: Mistake,
}

/// What is wrong with a line, and what was expected.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Mistake {
    /// Too many or too few fields.
    #[error("expected {expected} fields ({layout}), got {found}")]
    FieldCount {
        /// How many there should be.
        expected: usize,
        /// A name for each.
        layout: &'static str,
        /// How many there are.
        found: usize,
    },
    /// A field that is not what its place asks for.
    #[error("expected {expected}, got `{found}`")]
    Field {
        /// What should be there.
        expected: &'static str,
        /// What is there.
        found: String,
    },
    /// A rotation that is none.
    #[error(transparent)]
    Rotation(#[from] NotARotation),
    /// A point that is none.
    #[error(transparent)]
    Coordinates(#[from] NoCoordinates),
    /// A value of another type than an edge takes it for.
    #[error(transparent)]
    Value(#[from] ValueError),
    /// A noise that is none.
    #[error("information matrix: {0}; to go on without it, choose the repair `reject` or `clamp`")]
    Noise(#[from] NoiseError),
    /// The same vertex again.
    #[error("vertex {id} is defined twice, first in line {first}; remove one of the two")]
    DuplicateVertex {
        /// Its number.
        id: u64,
        /// The line of the first definition.
        first: usize,
    },
    /// The same sensor again.
    #[error("PARAMS_SE3OFFSET {id} is defined twice, first in line {first}; remove one of the two")]
    DuplicateSensor {
        /// Its number.
        id: u64,
        /// The line of the first definition.
        first: usize,
    },
    /// Tags that no reader knows.
    #[error(
        "unknown tags, {lines} {}: {}; check their spelling, or leave these lines out with --lenient",
        if *lines == 1 { "line" } else { "lines" }, tags.join(", ")
    )]
    UnknownTags {
        /// How many lines have one.
        lines: usize,
        /// The first few of them.
        tags: Vec<String>,
    },
    /// An edge from a vertex to itself.
    #[error("the edge connects vertex {id} with itself")]
    SelfEdge {
        /// Its number.
        id: u64,
    },
    /// A number that no vertex and no edge has.
    #[error("there is no {what} {id}")]
    Unknown {
        /// What is missing.
        what: &'static str,
        /// Its number.
        id: u64,
    },
    /// A number above all that a file announces.
    #[error("there is no {what} {id}: the first line says that there are {count}, counted from 0")]
    NoSuch {
        /// What is missing.
        what: &'static str,
        /// Its number.
        id: u64,
        /// How many there are.
        count: usize,
    },
    /// More or fewer of something than a file announces.
    #[error("the first line asks for {expected} {what}, found {found}")]
    Count {
        /// What is counted.
        what: &'static str,
        /// How many there should be.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// A vertex used as another type than it has.
    #[error("vertex {id} is a {found} (line {first}), but is used as a {expected} here")]
    VertexType {
        /// Its number.
        id: u64,
        /// What the edge needs.
        expected: &'static str,
        /// What it is.
        found: &'static str,
        /// Where it was defined, or first used.
        first: usize,
    },
    /// Time that stands still or runs back.
    #[error("time stamps have to increase: {found} follows {previous}")]
    NotIncreasing {
        /// The time stamp before.
        previous: f64,
        /// The time stamp of this line.
        found: f64,
    },
    /// Bytes that are not UTF-8.
    #[error("expected text in UTF-8")]
    NotText,
    /// A file with nothing of what it is read for.
    #[error("expected {expected}, found none{}", unknown_tags(unknown))]
    Empty {
        /// What is missing.
        expected: &'static str,
        /// Tags that were found instead.
        unknown: Vec<String>,
    },
    /// A row of a table that cannot be read.
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

/// Collects problems while a file is read to its end.
pub(crate) struct Problems<'a> {
    path: &'a Path,
    text: &'a str,
    list: Vec<BadLine>,
    more: usize,
}

impl<'a> Problems<'a> {
    /// Of a file with this text.
    pub(crate) fn of(path: &'a Path, text: &'a str) -> Self {
        Self { path, text, list: vec![], more: 0 }
    }
    pub(crate) fn push(&mut self, line: usize, mistake: impl Into<Mistake>) {
        if self.list.len() < TOLD {
            self.list.push(BadLine { line, mistake: mistake.into() });
        } else {
            self.more += 1;
        }
    }
    /// The value, or the problem with it noted.
    pub(crate) fn ok<T>(&mut self, line: usize, result: Result<T, Mistake>) -> Option<T> {
        result.map_err(|mistake| self.push(line, mistake)).ok()
    }
    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }
    pub(crate) fn finish(self) -> Result<(), FormatError> {
        if self.is_empty() { Ok(()) } else { Err(self.into_error()) }
    }
    pub(crate) fn into_error(self) -> FormatError {
        let Self { path, text, list: mut problems, more } = self;
        // passes over a file meet its lines in more than one order
        problems.sort_by_key(|p| p.line);
        Malformed { path: path.to_owned(), problems, more, text: text.to_owned() }.into()
    }
}

pub(crate) fn io_error(path: &Path) -> impl FnOnce(io::Error) -> FormatError + '_ {
    move |source| FormatError::Io { path: path.to_owned(), source }
}
