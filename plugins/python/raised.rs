//! Exceptions of Python functions within a solve. They end the solve and are raised after it.
use pyo3::prelude::*;
use std::sync::Mutex;

/// The first exception of a Python function since the last call of [`raise`].
static RAISED: Mutex<Option<PyErr>> = Mutex::new(None);

/// Returns whether a Python function has raised an exception since [`raise`] was called.
pub(crate) fn has_raised() -> bool {
    RAISED.lock().is_ok_and(|raised| raised.is_some())
}

/// Raises the stored exception, if there is one.
pub(crate) fn raise() -> PyResult<()> {
    match RAISED.lock().ok().and_then(|mut raised| raised.take()) {
        Some(error) => Err(error),
        None => Ok(()),
    }
}

/// Stores an exception until the solve has ended; only the first one is kept.
pub(crate) fn store_exception(error: PyErr) {
    if let Ok(mut raised) = RAISED.lock() {
        raised.get_or_insert(error);
    }
}
