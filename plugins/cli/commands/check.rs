//! `manifactor check`: a document, without solving anything.
use crate::failure::Failure;
use crate::input::document::Content;
use crate::input::graph_file::{self, GraphFile, Reading};
use crate::input::run_file::RunArguments;
use crate::input::solver::SolverArguments;
use crate::output;
use crate::output::text::count;
use crate::status::Status;
use clap::Args;
use manifactor::config::{Document, Value};
use manifactor::slam::mapping::Mapping;
use manifactor::slam::run::Run as Running;
use serde_json::json;

/// Check a run or a graph without solving it: everything that is wrong, each at its line.
#[derive(Debug, Args)]
pub(crate) struct Check {
    #[command(flatten)]
    run: RunArguments,
    /// Load the data of a run and build its graphs too.
    #[arg(long)]
    load: bool,
    #[command(flatten)]
    reading: Reading,
    /// Print JSON: what is wrong, or that nothing is.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Check {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let path = &self.run.config;
        let solver = SolverArguments::set_only(&self.run.set);
        let found = match Content::open(path)? {
            Content::Graph(text, format) => graph(&self.reading.plain(path, &text, format, &solver)?),
            Content::Document(document) if is_graph(&document) => {
                graph(&graph_file::literal(document, &solver)?)
            }
            Content::Document(document) => self.document(document)?,
        };
        if self.json {
            output::json(&json!({ "errors": [], "found": found }));
        } else {
            output::print(&format!("{}: nothing wrong.\n{found}\n", path.display()));
        }
        Ok(Status::Done)
    }

    fn document(&self, document: Document) -> Result<String, Failure> {
        let document = self.run.read(document)?;
        let mut lines = vec![format!("A run of {}.", count(document.variants.len(), "variant"))];
        let mut run = Running::new(&document, self.run.data());
        for variant in document.variants.iter().filter(|_| self.load) {
            let sequence = run.sequence(variant)?;
            let mapping = Mapping::new(&sequence, &variant.settings).map_err(Failure::input)?;
            for warning in &mapping.warnings {
                output::say(&format!("warning: {}: {warning}", variant.name));
            }
            lines.push(format!(
                "{}: {}, {}, {}, {} of which {} mapped, {}",
                variant.name,
                count(sequence.frames.len(), "frame"),
                count(sequence.detections.len(), "detection"),
                count(mapping.values.len(), "variable"),
                count(mapping.objects.len(), "object"),
                mapping.mapped().count(),
                count(mapping.graph.factors().len(), "factor"),
            ));
        }
        Ok(lines.join("\n"))
    }
}

/// What a graph has, with what the reader had to decide on stderr.
fn graph(input: &GraphFile) -> String {
    for note in &input.notes {
        output::note(note);
    }
    graph_file::summary(input).trim_end().to_owned()
}

/// Whether a document is a literal graph. A run may have variables of its own, and has a source.
fn is_graph(document: &Document) -> bool {
    matches!(&document.root().value, Value::Table(t) if t.contains_key("variables") && !t.contains_key("source"))
}
