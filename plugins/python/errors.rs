//! Errors as Python exceptions; `manifactor.errors` has the classes.
use manifactor::config::{Diagnostic, Diagnostics, Fault, ReadError};
use manifactor_cli::Failure;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyList;
use std::fmt::Display;

/// One mistake, as `manifactor.errors.Mistake` takes it.
pub(crate) struct Mistake {
    /// The argument, such as `camera.fx`, or the file.
    pub place: String,
    pub message: String,
    pub help: Option<String>,
    /// Line and column in the file, from 1.
    pub line: Option<(usize, usize)>,
    /// The surrounding text, with the start and the number of the wrong characters.
    pub within: Option<(String, usize, usize)>,
}

impl Mistake {
    /// Creates a mistake in an argument.
    pub(crate) fn at(place: impl Into<String>, message: impl Display) -> Self {
        let (place, message) = (place.into(), message.to_string());
        Self { place, message, help: None, line: None, within: None }
    }

    pub(crate) fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }

    /// Converts a diagnostic of an argument, whose source has the argument's name (see
    /// [`crate::input::node`]).
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

/// Creates an exception of a class in `manifactor.errors`.
fn exception(class: &str, what: &str, mistakes: Vec<Mistake>) -> PyErr {
    let made = Python::attach(|py| {
        let mistakes: Vec<_> = mistakes.into_iter().map(|m| m.into_python(py)).collect::<PyResult<_>>()?;
        let class = py.import("manifactor.errors")?.getattr(class)?;
        Ok(PyErr::from_value(class.call1((what, PyList::new(py, mistakes)?))?))
    });
    made.unwrap_or_else(|error| error)
}

/// Creates an `ArgumentError`, which is a `ValueError`, for invalid arguments.
pub(crate) fn arguments(what: &str, mistakes: Vec<Mistake>) -> PyErr {
    exception("ArgumentError", what, mistakes)
}

/// Creates an `ArgumentError` for one invalid argument.
pub(crate) fn argument(what: &str, name: &str, message: impl Display) -> PyErr {
    arguments(what, vec![Mistake::at(name, message)])
}

/// Creates an `ArgumentError` from the diagnostics of arguments that were read like a document.
pub(crate) fn read(what: &str, diagnostics: &Diagnostics) -> PyErr {
    arguments(what, diagnostics.iter().map(Mistake::of_argument).collect())
}

/// Creates an `ArgumentError` for one row of arguments that are columns.
pub(crate) fn row(what: &str, row: usize, error: &ReadError, otherwise: &str) -> PyErr {
    let (fault, place) = (error.fault(), error.place().map_or(otherwise, |place| place.source.name()));
    let mut mistake = Mistake::at(format!("{place}, row {row}"), &fault);
    mistake.help = fault.help();
    arguments(what, vec![mistake])
}

/// Creates a `DocumentError` for an invalid file; if the file cannot be read, it is an `OSError` too.
pub(crate) fn document(diagnostics: &Diagnostics) -> PyErr {
    let unreadable = diagnostics.iter().all(|one| matches!(one.fault, Fault::Unreadable(_)));
    let class = if unreadable { "UnreadableError" } else { "DocumentError" };
    exception(class, "", diagnostics.iter().map(Mistake::of_file).collect())
}

/// Creates a `GraphError`, which is a `ValueError`, for a graph, values and a solver that do not fit
/// together.
pub(crate) fn graph(error: impl Display) -> PyErr {
    exception("GraphError", &error.to_string(), vec![])
}

/// Creates a `SolveError`, which is a `RuntimeError`, for a failure with valid input.
pub(crate) fn solve(error: impl Display) -> PyErr {
    exception("SolveError", &error.to_string(), vec![])
}

/// Creates a `SolveError` for a failed experiment; if a file cannot be read or written, it is an `OSError`
/// too.
pub(crate) fn failure(error: impl Into<Failure>) -> PyErr {
    let error = error.into();
    match &error {
        Failure::File { .. } => exception("FileError", &error.to_string(), vec![]),
        Failure::Input { message, help: Some(help) } => solve(format!("{message} ({help})")),
        _ => solve(error),
    }
}

/// Creates a `RuntimeError` for an internal error.
pub(crate) fn internal(error: impl Display) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}
