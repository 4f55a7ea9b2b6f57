//! Documents and graphs, from a file or from standard input.
use crate::failure::Failure;
use manifactor::config::{Document, Format};
use manifactor::formats::{GraphFormat, STDIN, read_text};
use std::path::Path;

/// What a file has.
pub(crate) enum Content {
    /// A document in TOML, JSON or YAML.
    Document(Document),
    /// A graph in one of the other formats.
    Graph(String, &'static GraphFormat),
}

impl Content {
    /// Reads a file; its extension tells what it is, or else how it begins.
    pub(crate) fn open(path: &Path) -> Result<Self, Failure> {
        if Format::of_path(path).is_some() {
            return Ok(Self::Document(Document::open(path)?));
        }
        // a pipe can be read once
        let text = read_text(path)?;
        match GraphFormat::of(path, &text) {
            Some(format) => Ok(Self::Graph(text, format)),
            None if path == Path::new(STDIN) => Ok(Self::Document(parse(text)?)),
            None => Err(unknown_format(path)),
        }
    }
}

/// Reads a document, where nothing else will do.
pub(crate) fn open(path: &Path) -> Result<Document, Failure> {
    if path == Path::new(STDIN) { parse(read_text(path)?) } else { Ok(Document::open(path)?) }
}

/// A document without a name: JSON begins with a brace, all else is TOML.
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
