//! `manifactor schema`: one JSON Schema for editors.
use crate::failure::Failure;
use crate::output;
use crate::status::Status;
use clap::{Args, ValueEnum};
use manifactor::config::graph_schema;

/// Print the JSON Schema of a document, for editors to complete and check by.
#[derive(Debug, Args)]
pub(crate) struct Schema {
    /// Which kind of document.
    #[arg(value_enum, default_value = "graph")]
    document: Document,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Document {
    /// A literal graph: what `solve` takes.
    Graph,
}

impl Schema {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        match self.document {
            Document::Graph => output::json(&graph_schema()),
        }
        Ok(Status::Done)
    }
}
