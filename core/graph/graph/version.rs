//! Versions, which distinguish the states of a graph.
use std::sync::atomic::{AtomicU64, Ordering};

/// A state of a graph's content. Two graphs have equal versions only if one is a clone of the other and
/// neither was changed since.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Version(u64);

impl Default for Version {
    /// A new version, different from all earlier ones.
    fn default() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}
