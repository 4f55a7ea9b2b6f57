//! The one place where batches meet the thread pool: rayon is compiled here once, and not for each type of factor.

/// A task that threads may take from one another.
pub(super) type Task<'a> = &'a mut (dyn FnMut() + Send);

/// Runs both tasks, at the same time where a thread is idle.
pub(super) fn join(a: Task<'_>, b: Task<'_>) {
    rayon::join(a, b);
}

/// Runs a task on a thread of the pool, so that each [`join`] within it need not go there.
pub(super) fn enter(task: Task<'_>) {
    rayon::scope(|_| task());
}
