//! Documents and graphs, from a file or from standard input.
use crate::failure::Failure;
use manifactor::config::{Document, Format};
use manifactor::formats::{GraphFormat, STDIN, read_text};
use std::path::Path;

/// Content of a file.
pub(crate) enum Content {
    /// A document in TOML, JSON or YAML.
    Document(Document),
    /// A graph in one of the other formats.
    Graph(String, &'static GraphFormat),
}

impl Content {
    /// Reads a file. Its format follows from the extension, or else from the first characters.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        if Format::of_path(path).is_some() {
            return Ok(Self::Document(Document::open(path)?));
        }
        // a pipe can be read only once
        let text = read_text(path)?;
        match GraphFormat::detect(path, &text) {
            Some(format) => Ok(Self::Graph(text, format)),
            None if path == Path::new(STDIN) => Ok(Self::Document(parse(text)?)),
            None => Err(unknown_format(path)),
        }
    }
}

/// Reads a file that has to be a document.
pub(crate) fn open(path: &Path) -> Result<Document, Failure> {
    if path == Path::new(STDIN) { parse(read_text(path)?) } else { Ok(Document::open(path)?) }
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
        format!("{}: neither its extension nor its first line tells a format of graphs", path.display()),
        format!("use .toml, .json, .yaml, {}", known.join(", ")),
    )
}
