//! Graphs in files: documents and other formats.
use super::{Graph, Values, snapshot};
use crate::errors;
use crate::threads::detach;
use manifactor::config::{Document, Format, read_graph, write_graph};
use manifactor::formats::{FormatError, GraphFormat, InformationRepair, ReadOptions, read_text};
use manifactor::graph::{Graph as InnerGraph, GraphError, Values as InnerValues};
use pyo3::exceptions::PyOSError;
use pyo3::prelude::*;
use std::path::PathBuf;

/// Returns a graph as a document.
pub(crate) fn document(
    py: Python<'_>,
    graph: &InnerGraph,
    values: &InnerValues,
    format: &str,
) -> PyResult<String> {
    let format = match format {
        "toml" => Format::Toml,
        "json" => Format::Json,
        "yaml" => Format::Yaml,
        other => {
            let message = format!("expected \"toml\", \"json\" or \"yaml\", got {other:?}");
            return Err(errors::argument("to_document", "format", message));
        }
    };
    document_in(py, graph, values, format)
}

/// Returns a graph as a document, unless no reader would accept it.
fn document_in(py: Python<'_>, graph: &InnerGraph, values: &InnerValues, format: Format) -> PyResult<String> {
    let (found, written) = detach(py, || (graph.check(values), write_graph(graph, values, format)))?;
    let text = written.map_err(|error| errors::argument("to_document", "graph", error))?;
    if found.is_empty() { Ok(text) } else { Err(misfit(&found)) }
}

/// Path of a file, and its text.
type FileText = (PathBuf, String);

/// Returns the files of a graph at a path, in the format of its extension, with notes about what the format cannot
/// express. `like` is the file or folder from which the graph was read.
#[pyfunction]
fn formatted(
    py: Python<'_>,
    graph: &Bound<'_, Graph>,
    values: &Bound<'_, Values>,
    path: PathBuf,
    like: Option<PathBuf>,
) -> PyResult<(Vec<FileText>, Vec<String>)> {
    let (graph, values) = (snapshot(graph)?, values.try_borrow()?.0.snapshot());
    let (graph, values) = (&*graph, &*values);
    if let Some(format) = Format::of_path(&path) {
        return Ok((vec![(path, document_in(py, graph, values, format)?)], vec![]));
    }
    let Some(writer) = GraphFormat::of_destination(&path).and_then(|format| format.format) else {
        let written = GraphFormat::all().into_iter().filter(|format| format.format.is_some());
        let others: String =
            written.flat_map(|format| format.extensions).map(|e| format!(", .{e}")).collect();
        let message = format!(
            "{}: expected one of the extensions .toml, .json, .yaml{others}, or none for a folder",
            path.display()
        );
        return Err(errors::argument("save", "path", message));
    };
    let (found, written) = detach(py, || (graph.check(values), writer(graph, values, like.as_deref())))?;
    if !found.is_empty() {
        return Err(misfit(&found));
    }
    let written = written.map_err(|error| unreadable("save", "like", error))?;
    let files = written.at(&path).map(|(file, text)| (file, text.to_owned())).collect();
    Ok((files, written.notes))
}

/// The exception for mistakes between a graph and its values.
pub(super) fn misfit(found: &[GraphError]) -> PyErr {
    errors::graph(GraphError::list(found).trim_start())
}

/// Reads a graph from a file: a literal graph in TOML, JSON or YAML, or a graph in another linked format.
/// Returns the graph, its values, and notes about the decisions of the reader.
#[pyfunction]
#[pyo3(signature = (path, *, repair = "error", anchor = true, lenient = false))]
fn read(
    py: Python<'_>,
    path: PathBuf,
    repair: &str,
    anchor: bool,
    lenient: bool,
) -> PyResult<(Graph, Values, Vec<String>)> {
    let repair = match repair {
        "error" => InformationRepair::Error,
        "reject" => InformationRepair::Reject,
        "clamp" => InformationRepair::Clamp,
        other => {
            let message = format!("expected \"error\", \"reject\" or \"clamp\", got {other:?}");
            return Err(errors::argument("load", "repair", message));
        }
    };
    if Format::of_path(&path).is_some() {
        let read = detach(py, || Document::open(&path).and_then(|document| read_graph(&document)))?;
        let (graph, values) = read.map_err(|error| errors::document(&error))?;
        return Ok((Graph(graph.into()), Values(values.into()), vec![]));
    }
    let read = detach(py, || {
        let folder = GraphFormat::of_folder(&path);
        let file = folder.as_ref().map_or(&path, |(_, file)| file);
        let text = read_text(file)?;
        let format = folder.as_ref().map(|(format, _)| *format).or_else(|| GraphFormat::detect(&path, &text));
        format.map(|format| (format.parse)(&text, file, ReadOptions { repair, anchor, lenient })).transpose()
    })?;
    match read.map_err(|error| unreadable("load", "path", error))? {
        Some(read) => Ok((Graph(read.graph.into()), Values(read.values.into()), read.notes)),
        None => {
            let message = format!(
                "{}: neither its extension nor its first line tells a format of graphs",
                path.display()
            );
            Err(errors::argument("load", "path", message))
        }
    }
}

fn unreadable(function: &str, argument: &str, error: FormatError) -> PyErr {
    match error {
        FormatError::Io { path, source } => {
            let code = source.raw_os_error().unwrap_or_default();
            PyOSError::new_err((code, source.to_string(), path))
        }
        other => errors::argument(function, argument, other),
    }
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(read, module)?)?;
    module.add_function(wrap_pyfunction!(formatted, module)?)
}
