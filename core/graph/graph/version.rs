//! What tells one state of a graph from another.
use std::sync::atomic::{AtomicU64, Ordering};

/// A state of a graph's content. Two graphs have the same version only where one is a clone of the other, and neither has
/// been changed since.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Version(u64);

impl Default for Version {
    /// One that no graph has had.
    fn default() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}
