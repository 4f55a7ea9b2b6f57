//! Graphs in files, by extension.
use crate::failure::Failure;
use crate::input::solver::SolverArguments;
use crate::output::text::count;
use clap::{Args, ValueEnum};
use manifactor::config::{Document, Errors, Format, read_graph_section, write_graph};
use manifactor::formats::whole::{can_write, write_whole};
use manifactor::formats::{self, GraphFormat, GraphRead, GraphWriter, Repair, read_text};
use manifactor::graph::{Graph, Values};
use manifactor::solve::{Bytes, Optimizer, Start, available_memory, memory_limit};
use std::collections::BTreeMap;
use std::path::Path;

/// How a graph that is no document is read.
#[derive(Debug, Args)]
pub(crate) struct Reading {
    /// What to do with information matrices of a pose graph that are not positive definite.
    #[arg(long, value_enum, default_value = "error")]
    repair: RepairChoice,
    /// Do not hold the first pose where nothing in a pose graph fixes it; nor a scale, where images alone are seen.
    #[arg(long)]
    no_anchor: bool,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum RepairChoice {
    /// Say so, with the line, and stop.
    Error,
    /// Leave the edge out.
    Reject,
    /// Raise its eigenvalues to 1e-9 of the largest.
    Clamp,
}

/// What a file says.
pub(crate) struct GraphFile {
    pub graph: Graph,
    pub values: Values,
    pub optimizer: Box<dyn Optimizer>,
    pub start: Box<dyn Start>,
    /// What the reader had to decide.
    pub notes: Vec<String>,
}

impl Reading {
    /// Reads a graph, and the solver and start that file and command line ask for.
    pub(crate) fn open(&self, path: &Path, solver: &SolverArguments) -> Result<GraphFile, Failure> {
        check_memory(path)?;
        if Format::of_path(path).is_some() {
            literal(Document::open(path)?, solver)
        } else {
            self.plain(path, solver)
        }
    }

    /// A file in a registered format: solver and start are all that `--set` can set.
    fn plain(&self, path: &Path, solver: &SolverArguments) -> Result<GraphFile, Failure> {
        let mut settings = Document::parse("settings", "", Format::Toml)?;
        solver.apply(&mut settings)?;
        let errors = Errors::new();
        let chosen = settings.section(&errors).and_then(|mut section| {
            let optimizer = solver.take(&mut section, settings.source());
            let start = solver.take_start(&mut section, settings.source());
            section.finish();
            optimizer.zip(start)
        });
        let (optimizer, start) = errors.finish(chosen)?;
        // a pipe can be read once
        let text = read_text(path)?;
        let format = GraphFormat::of(path, &text).ok_or_else(|| no_format(path))?;
        let GraphRead { graph, values, notes } = (format.parse)(&text, path, self.choices())?;
        Ok(GraphFile { graph, values, optimizer, start, notes })
    }

    fn choices(&self) -> formats::Reading {
        let repair = match self.repair {
            RepairChoice::Error => Repair::Error,
            RepairChoice::Reject => Repair::Reject,
            RepairChoice::Clamp => Repair::Clamp,
        };
        formats::Reading { repair, anchor: !self.no_anchor }
    }
}

/// A literal graph, which may name its solver and its start.
pub(crate) fn literal(mut document: Document, solver: &SolverArguments) -> Result<GraphFile, Failure> {
    solver.apply(&mut document)?;
    let errors = Errors::new();
    let read = document.section(&errors).map(|mut section| {
        let (graph, values) = read_graph_section(&mut section);
        let optimizer = solver.take(&mut section, document.source());
        let start = solver.take_start(&mut section, document.source());
        section.finish();
        Some(GraphFile { graph, values, optimizer: optimizer?, start: start?, notes: Vec::new() })
    });
    Ok(errors.finish(read.flatten())?)
}

/// Refuses a file that is too large to be read, before it is.
fn check_memory(path: &Path) -> Result<(), Failure> {
    /// Bytes of a graph for each byte of its text: at least.
    const GROWTH: u64 = 8;
    // what cannot be read is told by who reads it
    let needed = std::fs::metadata(path).map_or(0, |file| file.len()).saturating_mul(GROWTH);
    // what is read in no time is not worth asking the system
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
            "{}: no memory for it: a graph of this size takes at least {needed}, and there are {available}",
            path.display()
        ),
        "allow more (ulimit -v), take fewer threads, or solve it in parts",
    ))
}

/// Whether the graph of `input` can be written here, and over what is there: asked before it is solved.
pub(crate) fn check_place(path: &Path, input: &Path, force: bool) -> Result<(), Failure> {
    if Format::of_path(path).is_none() && writer(path).is_none() {
        return Err(no_format(path));
    }
    if !force {
        refuse_to_replace(path, input)?;
    }
    can_write(path).map_err(Failure::at(path))
}

/// An error where a file would be lost.
fn refuse_to_replace(path: &Path, input: &Path) -> Result<(), Failure> {
    let is_stream = path.metadata().is_ok_and(|at| !at.is_file() && !at.is_dir());
    // a link that leads nowhere is something too
    if is_stream || path.symlink_metadata().is_err() {
        return Ok(());
    }
    let is_input =
        path.canonicalize().is_ok_and(|there| input.canonicalize().is_ok_and(|graph| graph == there));
    let what =
        if is_input { "is the graph itself, whose comments would be lost" } else { "is there already" };
    Err(Failure::with_help(
        format!("{} {what}", path.display()),
        "choose another name, or write over it with --force",
    ))
}

/// What writes a graph that is no document, by the extension.
fn writer(path: &Path) -> Option<GraphWriter> {
    GraphFormat::of_path(path)?.format
}

fn no_format(path: &Path) -> Failure {
    let written = GraphFormat::all().into_iter().filter(|format| format.format.is_some());
    let mut extensions = vec![".toml", ".json", ".yaml"];
    let others: Vec<String> =
        written.filter_map(|format| Some(format!(".{}", format.extensions.first()?))).collect();
    extensions.extend(others.iter().map(String::as_str));
    let last = extensions.pop().unwrap_or_default();
    Failure::with_help(
        format!("{}: the extension names no format that graphs are written in", path.display()),
        format!("use {} or {last}", extensions.join(", ")),
    )
}

/// Writes a graph with these values; returns what the format cannot express.
pub(crate) fn write(path: &Path, graph: &Graph, values: &Values) -> Result<Vec<String>, Failure> {
    let (text, notes) = match (Format::of_path(path), writer(path)) {
        (Some(format), _) => (write_graph(graph, values, format).map_err(Failure::input)?, Vec::new()),
        (None, Some(writer)) => writer(graph, values),
        (None, None) => return Err(no_format(path)),
    };
    write_whole(path, text.as_bytes()).map_err(Failure::at(path))?;
    Ok(notes)
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
