//! The formats of documents, selected by file extension.
mod json;
pub(crate) mod toml;
mod yaml;

use manifactor_document::Fault;
use manifactor_document::{Diagnostic, Diagnostics};
use manifactor_document::{MAX_DEPTH, Node};
use manifactor_document::{Place, SourceText};
use std::fmt;
use std::path::Path;

/// Largest size of a document. Unit: bytes.
pub const MAX_BYTES: u64 = 256 * 1024 * 1024;

/// A format of documents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// TOML 1.1, preferred for documents written by hand.
    Toml,
    /// Strict JSON: no comments, no trailing commas.
    Json,
    /// YAML 1.2, its core schema, without tags.
    Yaml,
}

impl Format {
    /// All formats.
    pub const ALL: [Format; 3] = [Format::Toml, Format::Json, Format::Yaml];

    /// Selects the format by extension: `toml`, `json`, `yaml` or `yml`, in any case.
    pub fn of_path(path: impl AsRef<Path>) -> Option<Self> {
        let extension = path.as_ref().extension()?.to_str()?.to_ascii_lowercase();
        match extension.as_str() {
            "toml" => Some(Format::Toml),
            "json" => Some(Format::Json),
            "yaml" | "yml" => Some(Format::Yaml),
            _ => None,
        }
    }

    /// Returns `TOML`, `JSON` or `YAML`.
    pub fn name(self) -> &'static str {
        match self {
            Format::Toml => "TOML",
            Format::Json => "JSON",
            Format::Yaml => "YAML",
        }
    }

    /// Parses a text. Returns errors if it is not valid in this format.
    pub fn parse(self, source: &SourceText) -> Result<Node, Diagnostics> {
        let bytes = source.text().len() as u64;
        if bytes > MAX_BYTES {
            let problem = Fault::TooLarge { bytes, limit: MAX_BYTES };
            return Err(Diagnostic::new(source.place(0..0), problem).into());
        }
        match self {
            Format::Toml => toml::parse(source),
            Format::Json => json::parse(source),
            Format::Yaml => yaml::parse(source),
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Creates the error for a node nested deeper than [`MAX_DEPTH`].
pub(crate) fn too_deep(place: Place) -> Diagnostic {
    Diagnostic::new(place, Fault::TooDeep { limit: MAX_DEPTH })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_extension_names_the_format() {
        assert_eq!(Format::of_path("a/b.TOML"), Some(Format::Toml));
        assert_eq!(Format::of_path("b.yml"), Some(Format::Yaml));
        assert_eq!(Format::of_path("b.json"), Some(Format::Json));
        assert_eq!(Format::of_path("b.g2o"), None);
        assert_eq!(Format::of_path("toml"), None);
    }
}
