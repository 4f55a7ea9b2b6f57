//! Errors as exceptions: `manifactor.errors` has their classes.
use manifactor::config::{Diagnostic, Diagnostics, Fault, ReadError};
use manifactor_cli::Failure;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyList;
use std::fmt::Display;

/// One thing that is wrong, as `manifactor.errors.Mistake` takes it.
pub(crate) struct Mistake {
    /// An argument, `camera.fx`, or a file.
    pub place: String,
    pub message: String,
    pub help: Option<String>,
    /// Line and column, from 1, of what was read from a file.
    pub line: Option<(usize, usize)>,
    /// A text that it is within, with the characters that are meant.
    pub within: Option<(String, usize, usize)>,
}

impl Mistake {
    /// At an argument.
    pub(crate) fn at(place: impl Into<String>, message: impl Display) -> Self {
        let (place, message) = (place.into(), message.to_string());
        Self { place, message, help: None, line: None, within: None }
    }

    pub(crate) fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }

    /// What is wrong with an argument: its sources are named after arguments, see [`crate::input::node`].
    fn of_argument(diagnostic: &Diagnostic) -> Self {
        let Diagnostic { place, fault, .. } = diagnostic;
        let mut mistake = Self::at(place.source.name(), fault);
        mistake.help = fault.help();
        let (text, span) = (place.source.text(), place.span());
        if !text.is_empty() && span != (0..text.len()) {
            let characters = |end: usize| text.get(..end).map_or(0, |before| before.chars().count());
            let (start, end) = (characters(span.start), characters(span.end));
            mistake.within = Some((text.to_owned(), start, (end - start).max(1)));
        }
        mistake
    }

    fn of_file(diagnostic: &Diagnostic) -> Self {
        let mut mistake = Self::at(diagnostic.place.source.name(), &diagnostic.fault);
        mistake.help = diagnostic.help();
        if !diagnostic.place.source.text().is_empty() {
            mistake.line = Some((diagnostic.line(), diagnostic.column()));
        }
        mistake
    }

    fn into_python(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        let class = py.import("manifactor.errors")?.getattr("Mistake")?;
        class.call1((self.place, self.message, self.help, self.line, self.within))
    }
}

/// The exception of a class of `manifactor.errors`.
fn exception(class: &str, what: &str, mistakes: Vec<Mistake>) -> PyErr {
    let made = Python::attach(|py| {
        let mistakes: Vec<_> = mistakes.into_iter().map(|m| m.into_python(py)).collect::<PyResult<_>>()?;
        let class = py.import("manifactor.errors")?.getattr(class)?;
        Ok(PyErr::from_value(class.call1((what, PyList::new(py, mistakes)?))?))
    });
    made.unwrap_or_else(|error| error)
}

/// Arguments that are not as they should be: an `ArgumentError`, which is a `ValueError`.
pub(crate) fn arguments(what: &str, mistakes: Vec<Mistake>) -> PyErr {
    exception("ArgumentError", what, mistakes)
}

/// One argument that is not as it should be.
pub(crate) fn argument(what: &str, name: &str, message: impl Display) -> PyErr {
    arguments(what, vec![Mistake::at(name, message)])
}

/// What is wrong with arguments that were read as a document is.
pub(crate) fn read(what: &str, diagnostics: &Diagnostics) -> PyErr {
    arguments(what, diagnostics.iter().map(Mistake::of_argument).collect())
}

/// What is wrong with one row of arguments that are columns.
pub(crate) fn row(what: &str, row: usize, error: &ReadError, otherwise: &str) -> PyErr {
    let (fault, place) = (error.fault(), error.place().map_or(otherwise, |place| place.source.name()));
    let mut mistake = Mistake::at(format!("{place}, row {row}"), &fault);
    mistake.help = fault.help();
    arguments(what, vec![mistake])
}

/// A file that is not as it should be: a `DocumentError`; one that cannot be read, an `OSError` as well.
pub(crate) fn document(diagnostics: &Diagnostics) -> PyErr {
    let unreadable = diagnostics.iter().all(|one| matches!(one.fault, Fault::Unreadable(_)));
    let class = if unreadable { "UnreadableError" } else { "DocumentError" };
    exception(class, "", diagnostics.iter().map(Mistake::of_file).collect())
}

/// A graph, values and a solver that do not fit each other: a `GraphError`, which is a `ValueError`.
pub(crate) fn graph(error: impl Display) -> PyErr {
    exception("GraphError", &error.to_string(), vec![])
}

/// What could not be done with input that is right: a `SolveError`, which is a `RuntimeError`.
pub(crate) fn solve(error: impl Display) -> PyErr {
    exception("SolveError", &error.to_string(), vec![])
}

/// What keeps an experiment from its files: a `SolveError`, and an `OSError` too if a file cannot be written or read.
pub(crate) fn failure(error: impl Into<Failure>) -> PyErr {
    let error = error.into();
    match &error {
        Failure::File { .. } => exception("FileError", &error.to_string(), vec![]),
        Failure::Input { message, help: Some(help) } => solve(format!("{message} ({help})")),
        _ => solve(error),
    }
}

/// For what cannot happen.
pub(crate) fn internal(error: impl Display) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}
