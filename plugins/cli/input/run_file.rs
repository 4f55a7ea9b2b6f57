//! Arguments for the document of a run.
use crate::failure::Failure;
use crate::input::kind::{self, InputKind};
use crate::input::{document, recording};
use clap::Args;
use manifactor::config::Document;
use manifactor::slam::run_document::RunDocument;
use std::path::{Path, PathBuf};

/// Arguments of all commands that read a run's document.
#[derive(Debug, Args)]
pub(crate) struct RunArguments {
    /// The document that describes the run, or a recording of ROS 2, whose settings are guessed; `-` reads TOML or
    /// JSON from standard input.
    pub(crate) config: PathBuf,
    /// Set a value of the document, such as `solver.stop.max_iterations=50` or `source.seed=2`.
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// The folder of the public data sets.
    #[arg(long, value_name = "DIR", env = "MANIFACTOR_DATA")]
    data: Option<PathBuf>,
}

impl RunArguments {
    /// Reads the document.
    pub(crate) fn open(&self) -> Result<RunDocument, Failure> {
        if InputKind::of_path(&self.config) == Some(InputKind::Mcap) {
            return self.read(recording::document(&self.config)?);
        }
        self.read(document::open(&self.config, kind::RUN)?)
    }

    /// Reads a document that is already open.
    pub(crate) fn read(&self, mut document: Document) -> Result<RunDocument, Failure> {
        document.set(&self.set)?;
        Ok(RunDocument::read(&document)?)
    }

    /// The folder of the data sets.
    pub(crate) fn data(&self) -> Option<PathBuf> {
        self.data.as_deref().map(Path::to_owned)
    }
}
