//! Graphs in files, by extension.
use crate::failure::Failure;
use crate::solver::SolverArguments;
use crate::text::count;
use clap::Args;
use manifactor::config::{Document, Errors, Format, read_graph_section, write_graph};
use manifactor::graph::{Graph, Values};
use manifactor::solve::Optimizer;
use std::collections::BTreeMap;
use std::path::Path;

/// How a graph is read.
#[derive(Debug, Args)]
pub(crate) struct Reading {}

/// What a file says.
pub(crate) struct GraphFile {
    pub graph: Graph,
    pub values: Values,
    pub optimizer: Box<dyn Optimizer>,
    pub warnings: Vec<String>,
}

impl Reading {
    /// Reads a graph, and the solver that file and command line ask for.
    pub(crate) fn open(&self, path: &Path, solver: &SolverArguments) -> Result<GraphFile, Failure> {
        literal(path, solver)
    }
}

/// A literal graph, which may name its solver.
fn literal(path: &Path, solver: &SolverArguments) -> Result<GraphFile, Failure> {
    let mut document = Document::open(path)?;
    solver.apply(&mut document)?;
    let errors = Errors::new();
    let read = document.section(&errors).map(|mut section| {
        let (graph, values) = read_graph_section(&mut section);
        let optimizer = solver.take(&mut section, document.source());
        section.finish();
        Some(GraphFile { graph, values, optimizer: optimizer?, warnings: Vec::new() })
    });
    Ok(errors.finish(read.flatten())?)
}

/// Writes a graph with these values.
pub(crate) fn write(path: &Path, graph: &Graph, values: &Values) -> Result<(), Failure> {
    let format = Format::of_path(path).ok_or_else(|| {
        Failure::with_help(
            format!("{}: the extension names no format that graphs are written in", path.display()),
            "use .toml, .json, .yaml or .g2o",
        )
    })?;
    let text = write_graph(graph, values, format).map_err(Failure::input)?;
    std::fs::write(path, text).map_err(Failure::at(path))
}

/// What is in a graph, in a few lines.
pub(crate) fn summary(input: &GraphFile) -> String {
    let variables = by_name(input.values.iter().map(|(_, v)| v.typetag_name()));
    let factors = by_name(input.graph.factors().iter().map(|f| f.factor.typetag_name()));
    format!(
        "{} ({variables})\n{} ({factors})\n",
        count(input.values.len(), "variable"),
        count(input.graph.factors().len(), "factor")
    )
}

fn by_name(names: impl Iterator<Item = &'static str>) -> String {
    let mut counts = BTreeMap::new();
    for name in names {
        *counts.entry(name).or_insert(0) += 1;
    }
    counts.iter().map(|(name, n)| format!("{n} {name}")).collect::<Vec<_>>().join(", ")
}
