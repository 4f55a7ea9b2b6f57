//! The output file of a graph, and protection against overwriting.
use crate::failure::Failure;
use crate::output;
use clap::{ArgGroup, Args};
use manifactor::config::{Format, write_graph};
use manifactor::formats::whole::{check_writable, write_whole};
use manifactor::formats::{GraphFormat, GraphText, GraphWriter};
use manifactor::graph::{Graph, Values};
use std::path::{Path, PathBuf};

/// `--out` and `--force`. Further files that `--force` may overwrite are in the group `written`.
#[derive(Debug, Args)]
#[command(group = ArgGroup::new("written").multiple(true))]
pub(crate) struct Destination {
    /// Write the graph with the estimate to this file; the extension selects the format. A name without an extension is
    /// a folder for a model of COLMAP.
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
        let format = GraphFormat::of_destination(path).filter(|format| format.format.is_some());
        if Format::of_path(path).is_some() || format.is_some_and(|format| format.folder.is_none()) {
            if !self.force {
                refuse_to_replace(path, input, "is the input graph, and its comments would be lost")?;
            }
            return check_writable(path).map_err(Failure::at(path));
        }
        let main = format.and_then(|format| format.folder).ok_or_else(|| no_format(path))?;
        if !self.force && path.join(main).exists() {
            let what = format!("{} has a model already", path.display());
            return Err(Failure::with_help(what, "choose another name, or overwrite it with --force"));
        }
        if path.exists() && !path.is_dir() {
            let what = format!("{} is a file; expected a folder for a model of COLMAP", path.display());
            return Err(Failure::with_help(what, "choose another name"));
        }
        Ok(())
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
    /// cannot express. `input` is the path from which the graph was read.
    pub(crate) fn write(&self, graph: &Graph, values: &Values, input: &Path) -> Result<(), Failure> {
        let Some(path) = &self.out else { return Ok(()) };
        let written = match (Format::of_path(path), writer(path)) {
            (Some(format), _) => {
                GraphText::file(write_graph(graph, values, format).map_err(Failure::input)?, vec![])
            }
            (None, Some(writer)) => writer(graph, values, Some(input))?,
            (None, None) => return Err(no_format(path)),
        };
        // the main file of a folder was looked for before the solve
        let mut others = written.at(path).filter(|(file, _)| file != path);
        if let Some((file, _)) = others.find(|(file, _)| !self.force && file.exists()) {
            let what = format!("{} exists already", file.display());
            return Err(Failure::with_help(what, "choose another folder, or overwrite it with --force"));
        }
        for (file, text) in written.at(path) {
            if file != *path {
                std::fs::create_dir_all(path).map_err(Failure::at(path))?;
            }
            write_whole(&file, text.as_bytes()).map_err(Failure::at(&file))?;
        }
        written.notes.iter().for_each(|note| output::print_note(note));
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
    GraphFormat::of_destination(path)?.format
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
        format!("use {} or {last}, or for a model of COLMAP the name of a folder", extensions.join(", ")),
    )
}
