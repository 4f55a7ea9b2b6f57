//! Documents and graphs, from a file or from standard input.
use crate::failure::Failure;
use crate::input::kind::{Expected, InputKind};
use manifactor::config::{Diagnostics, Document, Format};
use manifactor::formats::{GraphFormat, STDIN, read_text};
use std::path::{Path, PathBuf};

/// Content of a file.
pub(crate) enum Content {
    /// A document in TOML, JSON or YAML.
    Document(Document),
    /// A graph in one of the other formats.
    Graph {
        /// The text of its file.
        text: String,
        /// Path of the file; in a folder, that of its main file.
        file: PathBuf,
        /// The format.
        format: &'static GraphFormat,
    },
}

impl Content {
    /// Reads a file. Its format follows from the extension, or else from the first characters. A file of a
    /// kind that is not expected is an error that names the command for it.
    pub(crate) fn open(path: &Path, expected: Expected) -> Result<Self, Failure> {
        if let Some((format, file)) = GraphFormat::of_folder(path) {
            expected.check(path, Some(InputKind::GraphText))?;
            return Ok(Self::Graph { text: read_text(&file)?, file, format });
        }
        expected.refuse_folder(path)?;
        expected.check(path, InputKind::of_path(path))?;
        if Format::of_path(path).is_some() {
            let document = Document::open(path).map_err(|error| frames_or(error, path, expected))?;
            expected.check(path, InputKind::of_document(&document))?;
            return Ok(Self::Document(document));
        }
        // a pipe can be read only once
        let text = read_text(path)?;
        expected.check(path, InputKind::of_text(path, &text))?;
        match GraphFormat::detect(path, &text) {
            Some(format) => Ok(Self::Graph { text, file: path.to_owned(), format }),
            None if path == Path::new(STDIN) => {
                let document = parse(text)?;
                expected.check(path, InputKind::of_document(&document))?;
                Ok(Self::Document(document))
            }
            None if expected.has_graph_texts() => Err(unknown_format(path)),
            // reports the extensions of documents
            None => Ok(Self::Document(Document::open(path)?)),
        }
    }
}

/// Reads a file that has to be a document.
pub(crate) fn open(path: &Path, expected: Expected) -> Result<Document, Failure> {
    match Content::open(path, expected)? {
        Content::Document(document) => Ok(document),
        Content::Graph { .. } => Err(unknown_format(path)),
    }
}

/// Returns a better error for a JSON file with several lines of frames, else the parser's error.
fn frames_or(error: Diagnostics, path: &Path, expected: Expected) -> Failure {
    let kind = read_text(path).ok().and_then(|text| InputKind::of_text(path, &text));
    match expected.check(path, kind.filter(|kind| *kind == InputKind::Frames)) {
        Err(failure) => failure,
        Ok(()) => error.into(),
    }
}

/// Parses a document without a file name: JSON begins with a brace, everything else is TOML.
fn parse(text: String) -> Result<Document, Failure> {
    let format = if text.trim_start().starts_with('{') { Format::Json } else { Format::Toml };
    Ok(Document::parse("standard input", text, format)?)
}

fn unknown_format(path: &Path) -> Failure {
    let known: Vec<String> =
        GraphFormat::all().iter().flat_map(|format| format.extensions).map(|e| format!(".{e}")).collect();
    Failure::with_help(
        format!("{}: neither the extension nor the first line shows a format of graphs", path.display()),
        format!("use .toml, .json, .yaml, {}", known.join(", ")),
    )
}
