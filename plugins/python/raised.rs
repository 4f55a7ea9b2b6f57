//! Exceptions of Python functions within a call of the core. They end the call and are raised after it.
use pyo3::prelude::*;
use std::cell::RefCell;

thread_local! {
    /// The first exception of a Python function within the innermost [`catch`] of this thread. The core
    /// evaluates the factors of Python functions on the thread of the call, so threads do not share it.
    static RAISED: RefCell<Option<PyErr>> = const { RefCell::new(None) };
}

/// Runs work that may evaluate factors of Python functions.
///
/// # Errors
/// The first exception of such a function. Calls within a function have separate exceptions.
pub(crate) fn catch<T>(work: impl FnOnce() -> T) -> PyResult<T> {
    let outer = RAISED.take();
    let done = work();
    RAISED.replace(outer).map_or(Ok(done), Err)
}

/// Returns whether a Python function has raised an exception within the innermost [`catch`].
pub(crate) fn has_raised() -> bool {
    RAISED.with_borrow(Option::is_some)
}

/// Stores an exception until the call has ended; only the first one is kept.
pub(crate) fn store_exception(error: PyErr) {
    RAISED.with_borrow_mut(|raised| {
        raised.get_or_insert(error);
    });
}
