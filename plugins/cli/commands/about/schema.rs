//! `manifactor schema`: one JSON Schema for editors.
use crate::failure::Failure;
use crate::input::graph_file;
use crate::output;
use crate::status::Status;
use clap::{Args, ValueEnum};
use manifactor::config::Definitions;
use manifactor::slam::schema::{experiment_root, rules_root, run_root};
use serde_json::{Value, json};

/// Print the JSON Schema of a document, with which editors complete and check it.
#[derive(Debug, Args)]
pub(crate) struct Schema {
    /// The kind of document.
    #[arg(value_enum, default_value = "any")]
    document: Document,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Document {
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
}

impl Schema {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let mut definitions = Definitions::new();
        let root = match self.document {
            Document::Graph => graph_file::root(&mut definitions),
            Document::Run => run_root(&mut definitions),
            Document::Experiment => experiment_root(&mut definitions),
            Document::Rules => rules_root(&mut definitions),
            Document::Any => {
                let roots = [graph_file::root, run_root, experiment_root, rules_root];
                let any = roots.map(|root: fn(&mut Definitions) -> Value| root(&mut definitions));
                json!({ "title": "A document of Manifactor", "anyOf": any })
            }
        };
        output::json(&definitions.document(root));
        Ok(Status::Done)
    }
}
