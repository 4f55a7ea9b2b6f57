//! Graphs in files, by extension.
use crate::failure::Failure;
use crate::input::choice::choose;
use crate::input::document::Content;
use crate::input::kind;
use crate::input::solver::SolverArguments;
use crate::output::text::{count, on_one_line};
use clap::{Args, ValueEnum};
use manifactor::config::{Definitions, Document, Errors, Format, graph_root, read_graph_section};
use manifactor::formats::{self, GraphFormat, GraphRead, InformationRepair};
use manifactor::graph::loss::Loss;
use manifactor::graph::{Graph, Values};
use manifactor::smoother::SmootherSettings as Online;
use manifactor::solve::{Bytes, Optimizer, Start, available_memory, memory_limit};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Options for reading a graph that is not a document.
#[derive(Debug, Args)]
pub(crate) struct Reading {
    /// Treatment of edges in a pose graph whose information matrix is not positive definite.
    #[arg(long, value_enum, default_value = "error")]
    repair: RepairChoice,
    /// Do not fix a free gauge: neither the first pose, nor the scale if only images constrain it.
    #[arg(long)]
    no_anchor: bool,
    /// Skip lines with unknown tags and report them; by default they are an error.
    #[arg(long)]
    lenient: bool,
    /// Give every factor this robust loss, one of `manifactor list losses`; `--set loss.scale=2.0` sets its scale. In a
    /// document, each factor has its own.
    #[arg(long, value_name = "NAME")]
    loss: Option<String>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum RepairChoice {
    /// Stop, and report the line.
    Error,
    /// Skip the edge.
    Reject,
    /// Raise the eigenvalues to 1e-9 of the largest one.
    Clamp,
}

/// Content of a graph's file.
pub(crate) struct GraphFile {
    pub graph: Graph,
    pub values: Values,
    pub optimizer: Box<dyn Optimizer>,
    pub start: Box<dyn Start>,
    /// Settings of the smoother for `replay`.
    pub online: Online,
    /// Decisions of the reader, for the user.
    pub notes: Vec<String>,
}

impl Reading {
    /// Reads a graph, and the solver and start that the file and the command line choose.
    pub(crate) fn open(&self, path: &Path, solver: &SolverArguments) -> Result<GraphFile, Failure> {
        check_memory(path)?;
        match Content::open(path, kind::GRAPH)? {
            Content::Document(_) if self.loss.is_some() => Err(Failure::with_help(
                "--loss: a document gives each factor its own loss",
                "write `loss = { type = \"cauchy\" }` in the tables of its factors",
            )),
            Content::Document(document) => literal(document, solver),
            Content::Graph { text, file, format } => self.plain(&file, &text, format, solver),
        }
    }

    /// Reads a file in a registered format. `--set` can only set its solver, its start, its loss and `online`.
    pub(crate) fn plain(
        &self,
        path: &Path,
        text: &str,
        format: &GraphFormat,
        solver: &SolverArguments,
    ) -> Result<GraphFile, Failure> {
        let mut settings = Document::parse("settings", "", Format::Toml)?;
        solver.apply(&mut settings)?;
        let errors = Errors::new();
        let chosen = settings.section(&errors).and_then(|mut section| {
            let optimizer = solver.read_solver(&mut section, settings.source());
            let start = solver.read_start(&mut section, settings.source());
            let online = section.optional("online").unwrap_or_default();
            let loss = self.loss.as_deref().map(|name| {
                choose::<dyn Loss>(&mut section, "loss", ("--loss", Some(name)), name, settings.source())
            });
            section.finish();
            Some((optimizer?, start?, online, loss.map_or(Some(None), |loss| loss.map(Some))?))
        });
        let (optimizer, start, online, loss) = errors.finish(chosen)?;
        let GraphRead { mut graph, values, mut notes } = (format.parse)(text, path, self.choices())?;
        if let Some(loss) = loss {
            let loss: Arc<dyn Loss> = loss.into();
            notes.push(format!("every factor has the loss {}", loss.typetag_name()));
            graph.factors_mut().iter_mut().for_each(|entry| entry.loss = Some(loss.clone()));
        }
        Ok(GraphFile { graph, values, optimizer, start, online, notes })
    }

    fn choices(&self) -> formats::ReadOptions {
        let repair = match self.repair {
            RepairChoice::Error => InformationRepair::Error,
            RepairChoice::Reject => InformationRepair::Reject,
            RepairChoice::Clamp => InformationRepair::Clamp,
        };
        formats::ReadOptions { repair, anchor: !self.no_anchor, lenient: self.lenient }
    }
}

/// The schema of a graph's document: the graph, and the further fields that the commands read.
pub(crate) fn root(definitions: &mut Definitions) -> Value {
    let mut root = graph_root(definitions);
    let online = definitions.of::<Online>();
    if let Some(Value::Object(properties)) = root.get_mut("properties") {
        properties.insert("online".to_owned(), online);
        for (field, docs) in
            [("solver", "The solver. Default: auto."), ("start", "The initial values. Default: given.")]
        {
            if let Some(Value::Object(property)) = properties.get_mut(field) {
                property.entry("description").or_insert_with(|| docs.into());
            }
        }
    }
    root
}

/// Reads a literal graph, with its solver, its start and its settings for `replay`.
pub(crate) fn literal(mut document: Document, solver: &SolverArguments) -> Result<GraphFile, Failure> {
    solver.apply(&mut document)?;
    let errors = Errors::new();
    let read = document.section(&errors).map(|mut section| {
        let (graph, values) = read_graph_section(&mut section);
        let optimizer = solver.read_solver(&mut section, document.source());
        let start = solver.read_start(&mut section, document.source());
        let online = section.optional("online").unwrap_or_default();
        section.finish();
        Some(GraphFile { graph, values, optimizer: optimizer?, start: start?, online, notes: Vec::new() })
    });
    Ok(errors.finish(read.flatten())?)
}

/// Returns an error, before reading, if a file is too large for the memory.
fn check_memory(path: &Path) -> Result<(), Failure> {
    /// Lower bound for the bytes of a graph per byte of its text.
    const GROWTH: u64 = 8;
    // a file that cannot be read is reported by its reader
    let needed = std::fs::metadata(path).map_or(0, |file| file.len()).saturating_mul(GROWTH);
    // a small file does not justify a system call
    const SMALL: u64 = 64 << 20;
    if needed < SMALL && memory_limit().is_none() {
        return Ok(());
    }
    let available = available_memory();
    if needed <= available {
        return Ok(());
    }
    let (needed, available) = (Bytes(needed), Bytes(available));
    Err(Failure::with_help(
        format!(
            "{}: not enough memory: a graph of this size needs at least {needed}, and {available} are available",
            path.display()
        ),
        "raise the limit (ulimit -v), use fewer threads, or solve the graph in parts",
    ))
}

/// The title of pictures and pages: the name of the file.
pub(crate) fn title(path: &Path) -> String {
    let name = if path == Path::new(formats::STDIN) { None } else { path.file_name() };
    name.map_or_else(|| "graph".to_owned(), |name| on_one_line(&name.to_string_lossy()).into_owned())
}

/// A summary of a graph, in a few lines.
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
