//! `manifactor schema`: one JSON Schema for editors.
use crate::failure::Failure;
use crate::output;
use crate::reference::documents::DOCUMENTS;
use crate::status::Status;
use clap::{Args, ValueEnum};
use manifactor::config::Definitions;
use serde_json::{Value, json};

/// Print the JSON Schema of a kind of document, for completion and checks in editors.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor schema run > run.schema.json")]
pub(crate) struct Schema {
    /// The kind of document.
    #[arg(value_enum, default_value = "any")]
    document: Choice,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Choice {
    /// Any kind of document.
    Any,
    /// A literal graph, the input of `solve`.
    Graph,
    /// A run, the input of `run`.
    Run,
    /// A run over a grid of settings, the input of `experiment`.
    Experiment,
    /// A file of semantic rules, which a run refers to.
    Rules,
    /// A visual-inertial recording, the input of `vio`.
    VisualInertial,
    /// A frame of a stream, one line of JSON.
    Frame,
}

impl Schema {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let kind = |name: &str| DOCUMENTS.iter().find(|kind| kind.name == name);
        let one = match self.document {
            Choice::Any => None,
            Choice::Graph => kind("graph"),
            Choice::Run => kind("run"),
            Choice::Experiment => kind("experiment"),
            Choice::Rules => kind("rules"),
            Choice::VisualInertial => kind("visual-inertial"),
            Choice::Frame => kind("frame"),
        };
        let mut definitions = Definitions::new();
        let root = match one {
            Some(kind) => (kind.root)(&mut definitions),
            None => {
                // a frame is a line, not a document
                let documents = DOCUMENTS.iter().filter(|kind| kind.name != "frame");
                let any: Vec<Value> = documents.map(|kind| (kind.root)(&mut definitions)).collect();
                json!({ "title": "A document of Manifactor", "anyOf": any })
            }
        };
        output::print_json(&definitions.document(root));
        Ok(Status::Done)
    }
}
