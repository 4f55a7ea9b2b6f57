//! A document that was read from a file or a text.
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

/// A document: what its text says, with the place of everything.
#[derive(Debug, Clone, PartialEq)]
pub struct Document {
    source: SourceText,
    root: Node,
}

impl Document {
    /// Reads a file; its extension tells the format.
    ///
    /// # Errors
    /// An unknown extension, a file that cannot be read, and everything that is wrong with the syntax.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Diagnostics> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let fail =
            |problem| Diagnostics::from(Diagnostic::new(SourceText::new(&name, "").place(0..0), problem));
        let format = Format::of_path(path).ok_or_else(|| fail(Fault::UnknownFormat))?;
        let unreadable = |error: std::io::Error| fail(Fault::Unreadable(error.to_string()));
        let mut bytes = Vec::new();
        let file = std::fs::File::open(path).map_err(unreadable)?;
        // one byte more than allowed, so that too long a file is told from the longest one
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

    /// Reads a text; `name` is what its places are called.
    ///
    /// # Errors
    /// Everything that is wrong with the syntax.
    pub fn parse(
        name: impl Into<String>,
        text: impl Into<String>,
        format: Format,
    ) -> Result<Self, Diagnostics> {
        let text = text.into();
        // editors on Windows put a byte order mark first
        let source = SourceText::new(name, text.strip_prefix('\u{feff}').unwrap_or(&text));
        let root = format.parse(&source)?;
        Ok(Document { source, root })
    }

    /// The text.
    pub fn source(&self) -> &SourceText {
        &self.source
    }

    /// What it says.
    pub fn root(&self) -> &Node {
        &self.root
    }

    /// Applies overrides in order: `solver.max_iterations=50`, `factors[2].noise.sigma=0.1`. A value is read as TOML,
    /// and where it is none, taken as text. Tables that are missing are made.
    ///
    /// # Errors
    /// Overrides that cannot be read or have no place in the document, all of them.
    pub fn set<S: AsRef<str>>(&mut self, overrides: &[S]) -> Result<(), Diagnostics> {
        let errors = Errors::new();
        for text in overrides {
            apply(&mut self.root, text.as_ref(), &errors);
        }
        errors.finish(Some(()))
    }

    /// Puts another document over this one, as [`merge`] does.
    pub fn merge(&mut self, patch: Document) {
        merge(&mut self.root, patch.root);
    }

    /// The document as a table to be read; an error if it is none.
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
