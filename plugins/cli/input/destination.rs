//! The output file of a graph, and protection against overwriting.
use crate::failure::Failure;
use crate::output;
use clap::{ArgGroup, Args};
use manifactor::config::{Format, write_graph};
use manifactor::formats::whole::{check_writable, write_whole};
use manifactor::formats::{GraphFormat, GraphWriter};
use manifactor::graph::{Graph, Values};
use std::path::{Path, PathBuf};

/// `--out` and `--force`. Further files that `--force` may overwrite are in the group `written`.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("written").multiple(true))]
pub(crate) struct Destination {
    /// Write the graph with the estimate to this file; the extension selects the format.
    #[arg(long, short, value_name = "FILE", group = "written")]
    out: Option<PathBuf>,
    /// Overwrite an existing file.
    #[arg(long, requires = "written")]
    force: bool,
}

impl Destination {
    /// Returns an error if the graph of `input` cannot be written to this file. Called before the solve.
    pub(crate) fn check(&self, input: &Path) -> Result<(), Failure> {
        let Some(path) = &self.out else { return Ok(()) };
        if Format::of_path(path).is_none() && writer(path).is_none() {
            return Err(no_format(path));
        }
        if !self.force {
            refuse_to_replace(path, input, "is the input graph, and its comments would be lost")?;
        }
        check_writable(path).map_err(Failure::at(path))
    }

    /// Returns an error if a further file cannot be written. Called before the solve.
    pub(crate) fn check_other(&self, path: &Path, input: &Path) -> Result<(), Failure> {
        if !self.force {
            refuse_to_replace(path, input, "is the input graph")?;
        }
        check_writable(path).map_err(Failure::at(path))
    }

    /// Returns whether a graph is to be written.
    pub(crate) fn is_given(&self) -> bool {
        self.out.is_some()
    }

    /// Writes a graph with these values if an output file is given, and reports everything that the format
    /// cannot express.
    pub(crate) fn write(&self, graph: &Graph, values: &Values) -> Result<(), Failure> {
        let Some(path) = &self.out else { return Ok(()) };
        let (text, notes) = match (Format::of_path(path), writer(path)) {
            (Some(format), _) => (write_graph(graph, values, format).map_err(Failure::input)?, Vec::new()),
            (None, Some(writer)) => writer(graph, values),
            (None, None) => return Err(no_format(path)),
        };
        write_whole(path, text.as_bytes()).map_err(Failure::at(path))?;
        notes.iter().for_each(|note| output::print_note(note));
        Ok(())
    }
}

/// Returns an error if a file would be lost. `is_input` says so of the input itself.
pub(crate) fn refuse_to_replace(path: &Path, input: &Path, is_input: &str) -> Result<(), Failure> {
    let is_stream = path.metadata().is_ok_and(|at| !at.is_file() && !at.is_dir());
    // a dangling symbolic link counts as existing too
    if is_stream || path.symlink_metadata().is_err() {
        return Ok(());
    }
    let same = path.canonicalize().is_ok_and(|there| input.canonicalize().is_ok_and(|file| file == there));
    let what = if same { is_input } else { "exists already" };
    Err(Failure::with_help(
        format!("{} {what}", path.display()),
        "choose another name, or overwrite it with --force",
    ))
}

/// The writer for the extension of `path`, if its format is not a document.
fn writer(path: &Path) -> Option<GraphWriter> {
    GraphFormat::by_extension(path)?.format
}

fn no_format(path: &Path) -> Failure {
    let written = GraphFormat::all().into_iter().filter(|format| format.format.is_some());
    let mut extensions = vec![".toml", ".json", ".yaml"];
    let others: Vec<String> =
        written.filter_map(|format| Some(format!(".{}", format.extensions.first()?))).collect();
    extensions.extend(others.iter().map(String::as_str));
    let last = extensions.pop().unwrap_or_default();
    Failure::with_help(
        format!("{}: graphs cannot be written in a format with this extension", path.display()),
        format!("use {} or {last}", extensions.join(", ")),
    )
}
