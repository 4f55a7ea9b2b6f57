//! Which solver, and with which settings: `--solver`, `--set` and the document together.
use crate::failure::Failure;
use clap::Args;
use manifactor::config::{Document, Field, Node, Section, Source, Table, Value};
use manifactor::solve::{LevenbergMarquardt, Optimizer};

/// `--solver` and `--set`.
#[derive(Debug, Args)]
pub(crate) struct SolverArguments {
    /// The solver, one of `manifactor list solvers`, with its defaults; what `--set` says still holds.
    #[arg(long, value_name = "NAME")]
    solver: Option<String>,
    /// Set a value of the document, such as `solver.stop.max_iterations=50` or `factors[2].noise.sigma=0.1`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl SolverArguments {
    /// `--set` alone.
    pub(crate) fn set_only(set: &[String]) -> Self {
        Self { solver: None, set: set.to_vec() }
    }

    /// Puts what `--set` says into the document.
    pub(crate) fn apply(&self, document: &mut Document) -> Result<(), Failure> {
        Ok(document.set(&self.set)?)
    }

    /// Takes the field `solver` out of a document's table: Levenberg-Marquardt, where nobody says anything.
    pub(crate) fn take(&self, section: &mut Section<'_>, document: &Source) -> Option<Box<dyn Optimizer>> {
        let node = section.take("solver");
        let node = match (&self.solver, node) {
            (None, None) => return Some(Box::new(LevenbergMarquardt::default())),
            (None, Some(node)) if has_type(&node) => node,
            (None, Some(node)) => named("levenberg_marquardt", node, document),
            (Some(name), Some(node)) => named(name, node, document),
            (Some(name), None) => {
                let nothing = Source::argument("--solver", name.as_str());
                named(name, Node::new(nothing.place(0..name.len()), Value::Table(Table::new())), document)
            }
        };
        node.read_registered(section.errors())
    }
}

fn has_type(node: &Node) -> bool {
    !matches!(&node.value, Value::Table(table) if !table.contains_key("type"))
}

/// The same settings for the solver `name`. Those of another solver, in the document, are left behind.
fn named(name: &str, mut node: Node, document: &Source) -> Node {
    let Value::Table(table) = &mut node.value else { return node };
    let is = |field: &Field| matches!(&field.node.value, Value::String(text) if text == name);
    if !table.get("type").is_none_or(is) {
        table.retain(|_, field| field.key.source != *document);
    }
    let source = Source::argument("--solver", name);
    let place = source.place(0..name.len());
    let tag = Field { key: place.clone(), node: Node::new(place, Value::String(name.to_owned())) };
    table.insert("type".to_owned(), tag);
    node
}
