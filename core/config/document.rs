//! Documents from files and texts.
use crate::format::{Format, MAX_BYTES};
use crate::overrides::apply;
use manifactor_document::Fault;
use manifactor_document::Node;
use manifactor_document::Section;
use manifactor_document::SourceText;
use manifactor_document::merge;
use manifactor_document::{Diagnostic, Diagnostics, Errors};
use std::io::Read;
use std::path::Path;

/// A parsed document with the position of each value.
#[derive(Debug, Clone, PartialEq)]
pub struct Document {
    source: SourceText,
    root: Node,
}

impl Document {
    /// Reads a file. Its extension selects the format.
    ///
    /// # Errors
    /// If the extension is unknown, the file cannot be read, or its syntax is wrong. All syntax errors are
    /// returned.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Diagnostics> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let fail =
            |problem| Diagnostics::from(Diagnostic::new(SourceText::new(&name, "").place(0..0), problem));
        let format = Format::of_path(path).ok_or_else(|| fail(Fault::UnknownFormat))?;
        let unreadable = |error: std::io::Error| fail(Fault::Unreadable(error.to_string()));
        let mut bytes = Vec::new();
        let file = std::fs::File::open(path).map_err(unreadable)?;
        // one byte more than allowed, to detect files that are too long
        file.take(MAX_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
        tracing::debug!(file = name, bytes = bytes.len(), "read");
        let text = String::from_utf8(bytes).map_err(|error| {
            let at = error.utf8_error().valid_up_to();
            let text = error.as_bytes().get(..at).map(String::from_utf8_lossy).unwrap_or_default();
            let problem = Fault::invalid("cannot be read: the text is not UTF-8 from here on");
            Diagnostics::from(Diagnostic::new(SourceText::new(&name, text).place(at..at), problem))
        })?;
        Document::parse(name, text, format)
    }

    /// Reads a text. `name` is shown in its positions.
    ///
    /// # Errors
    /// All syntax errors.
    pub fn parse(
        name: impl Into<String>,
        text: impl Into<String>,
        format: Format,
    ) -> Result<Self, Diagnostics> {
        let text = text.into();
        // editors on Windows write a byte order mark first
        let source = SourceText::new(name, text.strip_prefix('\u{feff}').unwrap_or(&text));
        let root = format.parse(&source)?;
        Ok(Document { source, root })
    }

    /// Returns the text.
    pub fn source(&self) -> &SourceText {
        &self.source
    }

    /// Returns the root of the document.
    pub fn root(&self) -> &Node {
        &self.root
    }

    /// Applies overrides in order, such as `solver.max_iterations=50` and `factors[2].noise.sigma=0.1`. A
    /// value is parsed as TOML, or taken as a string if it is not valid TOML. Missing tables are created.
    ///
    /// # Errors
    /// All overrides that cannot be parsed or do not fit the document.
    pub fn set<S: AsRef<str>>(&mut self, overrides: &[S]) -> Result<(), Diagnostics> {
        let errors = Errors::new();
        for text in overrides {
            apply(&mut self.root, text.as_ref(), &errors);
        }
        errors.finish(Some(()))
    }

    /// Merges a document into this one, as [`merge`] does.
    pub fn merge(&mut self, patch: Document) {
        merge(&mut self.root, patch.root);
    }

    /// Starts to read the document as a table. Any other value is an error.
    ///
    /// ```
    /// use manifactor_config::{Document, Errors, Format};
    ///
    /// let document = Document::parse("run.toml", "seed = 1\nsteps = 'many'\nspeeed = 2", Format::Toml)?;
    /// let errors = Errors::new();
    /// let run = document.section(&errors).and_then(|mut run| {
    ///     let seed: Option<u64> = run.required("seed");
    ///     let steps: Option<u32> = run.required("steps");
    ///     let speed: Option<f64> = run.optional("speed");
    ///     run.finish();
    ///     Some((seed?, steps?, speed.unwrap_or(1.0)))
    /// });
    /// assert_eq!(
    ///     errors.finish(run).unwrap_err().to_string(),
    ///     "run.toml:2:9: expected a whole number, 0 or more, found the text \"many\"\n\
    ///      run.toml:3:1: unknown field `speeed` (did you mean `speed`? there are `seed`, `steps` and `speed`)"
    /// );
    /// # Ok::<(), manifactor_config::Diagnostics>(())
    /// ```
    pub fn section<'e>(&'e self, errors: &'e Errors) -> Option<Section<'e>> {
        Section::new(&self.root, errors)
    }
}
