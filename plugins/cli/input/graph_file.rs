//! Graphs in files, by extension.
use crate::failure::Failure;
use crate::input::solver::SolverArguments;
use crate::output::text::{count, list};
use clap::{Args, ValueEnum};
use manifactor::config::{Document, Errors, Format, read_graph_section, write_graph};
use manifactor::formats::pose_graph::{self, Options, Repair, Report};
use manifactor::formats::whole::{can_write, write_whole};
use manifactor::formats::{FormatError, bal, g2o, read_text};
use manifactor::graph::{Graph, Key, Values};
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

    /// g2o, TORO or BAL: solver and start are all that `--set` can set.
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
        let read = if is_bal(path, &text) { Self::bundle } else { Self::pose_graph };
        let (graph, values, notes) = read(self, &text, path)?;
        Ok(GraphFile { graph, values, optimizer, start, notes })
    }

    fn pose_graph(&self, text: &str, path: &Path) -> Result<Noted, Failure> {
        let repair = match self.repair {
            RepairChoice::Error => Repair::Error,
            RepairChoice::Reject => Repair::Reject,
            RepairChoice::Clamp => Repair::Clamp,
        };
        let options = Options { repair, anchor: !self.no_anchor, ..Options::default() };
        let read = pose_graph::parse(text, path, &options)?;
        let notes = notes(&read.report);
        Ok((read.graph, read.values, notes))
    }

    fn bundle(&self, text: &str, path: &Path) -> Result<Noted, Failure> {
        let bal::Bundle { graph, values, report } = bal::parse(text, path, !self.no_anchor)?;
        let mut notes = Vec::new();
        if !report.unobserved.is_empty() {
            notes.push(format!("nothing observes {}: held", keys(&report.unobserved)));
        }
        if !report.anchored.is_empty() {
            let held = keys(&report.anchored);
            notes.push(format!(
                "nothing fixes the gauge: held pose and scale by {held} (--no-anchor does not)"
            ));
        }
        Ok((graph, values, notes))
    }
}

/// A graph, its values, and what the reader had to decide.
type Noted = (Graph, Values, Vec<String>);

/// `.bal`; or a text that begins like one, as such files are often called `.txt`.
fn is_bal(path: &Path, text: &str) -> bool {
    is_named(path, "bal") || (is_named(path, "txt") && bal::begins(text))
}

fn keys(keys: &[Key]) -> String {
    list(keys.iter().map(ToString::to_string))
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

/// What a pose graph's file left open, and how it was filled in.
fn notes(report: &Report) -> Vec<String> {
    let mut notes = Vec::new();
    let lines = |lines: &[usize]| list(lines.iter().map(ToString::to_string));
    for (tag, n) in &report.unknown {
        notes.push(format!("unknown tag `{tag}`: {} left out", count(*n, "line")));
    }
    if !report.filled.is_empty() {
        let filled = count(report.filled.len(), "variable");
        notes.push(format!(
            "{filled} have no vertex line; their values come from a spanning tree of the edges"
        ));
    }
    if !report.anchored.is_empty() {
        notes
            .push(format!("nothing fixes the gauge: held {} (--no-anchor does not)", keys(&report.anchored)));
    }
    if !report.rejected.is_empty() {
        notes.push(format!(
            "edges left out, as their information is not positive definite: lines {}",
            lines(&report.rejected)
        ));
    }
    if !report.clamped.is_empty() {
        notes.push(format!("information made positive definite: lines {}", lines(&report.clamped)));
    }
    if report.equivalences_added > 0 {
        notes.push(format!(
            "{} without an edge: tied by a factor",
            count(report.equivalences_added, "EQUIV line")
        ));
    }
    notes
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
    if Format::of_path(path).is_none() && !is_named(path, "g2o") && !is_named(path, "bal") {
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

fn is_named(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

fn no_format(path: &Path) -> Failure {
    Failure::with_help(
        format!("{}: the extension names no format that graphs are written in", path.display()),
        "use .toml, .json, .yaml, .g2o or .bal",
    )
}

/// Writes a graph with these values; returns what the format has no word for.
pub(crate) fn write(path: &Path, graph: &Graph, values: &Values) -> Result<Vec<String>, Failure> {
    match Format::of_path(path) {
        Some(format) => {
            let text = write_graph(graph, values, format).map_err(Failure::input)?;
            write_whole(path, text.as_bytes()).map_err(Failure::at(path))?;
            Ok(Vec::new())
        }
        None if is_named(path, "g2o") => {
            Ok(omitted(&g2o::write(path, graph, values).map_err(|e: FormatError| Failure::from(e))?))
        }
        None if is_named(path, "bal") => {
            Ok(omitted_from_bal(&bal::write(path, graph, values).map_err(Failure::from)?))
        }
        None => Err(no_format(path)),
    }
}

fn omitted(omitted: &g2o::Omitted) -> Vec<String> {
    let mut notes = omitted_types("g2o", &omitted.variables, &omitted.factors);
    if omitted.losses > 0 {
        notes.push(format!("g2o has no word for robust losses: {} left out", omitted.losses));
    }
    if !omitted.partly_fixed.is_empty() {
        notes.push(format!(
            "g2o has no word for directions that are held: {} left out",
            omitted.partly_fixed.len()
        ));
    }
    if !omitted.renamed.is_empty() {
        notes.push(format!("{} renamed: g2o has numbers only", count(omitted.renamed.len(), "variable")));
    }
    notes
}

fn omitted_from_bal(omitted: &bal::Omitted) -> Vec<String> {
    let mut notes = omitted_types("BAL", &omitted.variables, &omitted.factors);
    let others =
        [("robust losses", omitted.losses), ("noise", omitted.noise), ("what is held", omitted.held)];
    for (what, n) in others.into_iter().filter(|(_, n)| *n > 0) {
        notes.push(format!("BAL has no word for {what}: {n} left out"));
    }
    notes
}

type ByName = BTreeMap<&'static str, usize>;

fn omitted_types(format: &str, variables: &ByName, factors: &ByName) -> Vec<String> {
    let counts = variables.iter().map(|c| (c, "variable")).chain(factors.iter().map(|c| (c, "factor")));
    let note = |((name, n), what): ((&&str, &usize), &str)| {
        format!("{format} has no word for {} of type {name}: left out", count(*n, what))
    };
    counts.map(note).collect()
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
