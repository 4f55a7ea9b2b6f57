//! The documents that describe runs.
use crate::failure::Failure;
use crate::input::document;
use clap::Args;
use manifactor::config::Document;
use manifactor::slam::run_document::RunDocument;
use std::path::{Path, PathBuf};

/// What all commands on a run's document take.
#[derive(Debug, Args)]
pub(crate) struct RunArguments {
    /// The document that describes the run; `-` is standard input, TOML or JSON.
    pub(crate) config: PathBuf,
    /// Set a value of the document, such as `solver.stop.max_iterations=50` or `source.seed=2`.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// The folder where public data sets lie.
    #[arg(long, value_name = "DIR", env = "MANIFACTOR_DATA")]
    data: Option<PathBuf>,
}

impl RunArguments {
    /// Reads the document.
    pub(crate) fn open(&self) -> Result<RunDocument, Failure> {
        self.read(document::open(&self.config)?)
    }

    /// A document that was opened already.
    pub(crate) fn read(&self, mut document: Document) -> Result<RunDocument, Failure> {
        document.set(&self.set)?;
        Ok(RunDocument::read(&document)?)
    }

    /// Where data sets lie.
    pub(crate) fn data(&self) -> Option<PathBuf> {
        self.data.as_deref().map(Path::to_owned)
    }
}
