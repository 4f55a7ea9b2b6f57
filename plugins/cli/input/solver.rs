//! The solver, the start and their settings, from `--solver`, `--start`, `--set` and the document.
use crate::failure::Failure;
use crate::input::choice::choose;
use clap::Args;
use manifactor::config::{Document, Section, SourceText};
use manifactor::solve::{Optimizer, Start};

/// `--solver`, `--start` and `--set`.
#[derive(Debug, Args)]
pub(crate) struct SolverArguments {
    /// The solver, one of `manifactor list solvers`, with its default settings; `--set` still applies.
    #[arg(long, value_name = "NAME")]
    solver: Option<String>,
    /// The initial values, one of `manifactor list starts`. Default: the values in the graph.
    #[arg(long, value_name = "NAME")]
    start: Option<String>,
    /// Set a value of the document, such as `solver.stop.max_iterations=50` or
    /// `factors[2].noise.sigma=0.1`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

impl SolverArguments {
    /// Returns whether `--start` is given.
    pub(crate) fn names_a_start(&self) -> bool {
        self.start.is_some()
    }

    /// Creates arguments with `--set` alone.
    pub(crate) fn set_only(set: &[String]) -> Self {
        Self { solver: None, start: None, set: set.to_vec() }
    }

    /// Applies `--set` to the document.
    pub(crate) fn apply(&self, document: &mut Document) -> Result<(), Failure> {
        Ok(document.set(&self.set)?)
    }

    /// Reads the field `solver` of a document's table. Default: `auto`.
    pub(crate) fn take(
        &self,
        section: &mut Section<'_>,
        document: &SourceText,
    ) -> Option<Box<dyn Optimizer>> {
        let argument = ("--solver", self.solver.as_deref());
        choose(section, "solver", argument, "auto", document)
    }

    /// Reads the field `start` of a document's table. Default: the values in the graph.
    pub(crate) fn take_start(
        &self,
        section: &mut Section<'_>,
        document: &SourceText,
    ) -> Option<Box<dyn Start>> {
        choose(section, "start", ("--start", self.start.as_deref()), "given", document)
    }
}
