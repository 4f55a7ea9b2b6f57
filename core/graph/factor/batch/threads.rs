//! The interface of batches to the thread pool: rayon is compiled once here instead of once per factor
//! type.

/// A task that idle threads may steal.
pub(super) type Task<'a> = &'a mut (dyn FnMut() + Send);

/// Runs both tasks, in parallel if a thread is idle.
pub(super) fn join(a: Task<'_>, b: Task<'_>) {
    rayon::join(a, b);
}

/// Runs a task on a thread of the pool, so that each [`join`] in it is already inside the pool.
pub(super) fn run_in_pool(task: Task<'_>) {
    rayon::scope(|_| task());
}
