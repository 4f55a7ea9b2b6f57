//! Threads in forked processes.
//!
//! A fork copies only the calling thread. The parent's thread pool has no threads in the child, so a solve
//! that waits for the pool never ends. If a process was forked after its parent has computed, each calling
//! thread gets a pool with one thread.
use pyo3::exceptions::PyRuntimeWarning;
use pyo3::prelude::*;
use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// The process that owns the threads of the global pool; 0 before the first computation.
static OWNER: AtomicU32 = AtomicU32::new(0);
/// True after this process has warned that it computes on one thread.
static HAS_WARNED: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// True if this thread has a separate pool. A fork copies it.
    static IS_ALONE: Cell<bool> = const { Cell::new(false) };
}

/// Computes without the interpreter's lock, on threads of this process. All calls that may evaluate factors of
/// Python functions pass through here.
///
/// # Errors
/// If a Python function raises an exception, if the user turns the warning into an error, or if the pool
/// cannot be built.
pub(crate) fn detach<T: Send>(py: Python<'_>, work: impl Send + FnOnce() -> T) -> PyResult<T> {
    prepare(py)?;
    py.detach(|| crate::raised::catch(work))
}

/// Gives the calling thread a pool of one thread if the threads of the global pool belong to another
/// process.
fn prepare(py: Python<'_>) -> PyResult<()> {
    let own = std::process::id();
    let is_owner = match OWNER.compare_exchange(0, own, Ordering::Relaxed, Ordering::Relaxed) {
        Ok(_) => true,
        Err(owner) => owner == own,
    };
    if is_owner || IS_ALONE.get() {
        return Ok(());
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    // the pool ends with the thread; if it were dropped, the thread would wait for the pool of the parent
    std::mem::forget(pool.map_err(crate::errors::solve)?);
    IS_ALONE.set(true);
    if HAS_WARNED.swap(true, Ordering::Relaxed) {
        return Ok(());
    }
    let message = c"this process was forked after its parent has computed with threads: it computes on one thread, with the same \
        results. The start methods `spawn` and `forkserver` of multiprocessing have all threads";
    PyErr::warn(py, &py.get_type::<PyRuntimeWarning>(), message, 1)
}
