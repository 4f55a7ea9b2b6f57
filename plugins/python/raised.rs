//! What functions of Python raise within a solve, which ends it and is raised once it has ended.
use pyo3::prelude::*;
use std::sync::Mutex;

/// What a function of Python has raised within a solve, until the solve has ended.
static RAISED: Mutex<Option<PyErr>> = Mutex::new(None);

/// Whether a function of Python has raised something since [`raise`] was called.
pub(crate) fn has_raised() -> bool {
    RAISED.lock().is_ok_and(|raised| raised.is_some())
}

/// Raises what a function of Python has raised.
pub(crate) fn raise() -> PyResult<()> {
    match RAISED.lock().ok().and_then(|mut raised| raised.take()) {
        Some(error) => Err(error),
        None => Ok(()),
    }
}

/// Keeps what was raised until the solve has ended; the first counts.
pub(crate) fn keep(error: PyErr) {
    if let Ok(mut raised) = RAISED.lock() {
        raised.get_or_insert(error);
    }
}
