//! Available memory, and the memory that a graph needs.
use manifactor_graph::{Graph, Values};
use std::fmt;
use std::sync::OnceLock;

/// A number of bytes in readable form: `12.0 MiB`, `1.50 GiB`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bytes(pub u64);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mib = self.0 as f64 / f64::from(1 << 20);
        if mib < 1024.0 { write!(f, "{mib:.1} MiB") } else { write!(f, "{:.2} GiB", mib / 1024.0) }
    }
}

/// Returns the bytes that this process can still allocate: the free memory of the system, or of a limit on
/// the process.
pub fn available_memory() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let left = system.available_memory();
    let left = system.cgroup_limits().map_or(left, |limits| left.min(limits.free_memory));
    left.min(below_limit())
}

/// Returns the limit of the address space of this process, in bytes (`ulimit -v`); `None` if no limit is
/// set.
#[cfg(unix)]
pub fn memory_limit() -> Option<u64> {
    rustix::process::getrlimit(rustix::process::Resource::As).current
}

/// Returns the limit of the address space of this process: `None`, as no limit is known on this system.
#[cfg(not(unix))]
pub fn memory_limit() -> Option<u64> {
    None
}

/// Returns the bytes below the limit of the address space; `u64::MAX` without a limit. The estimate is
/// conservative, because a failed allocation ends the program.
pub(crate) fn below_limit() -> u64 {
    // The limit is on addresses. They include the code, the main thread, and for each further thread the
    // reserve of its allocator and the buffer of a large product.
    const PROGRAM: u64 = 288 << 20;
    const THREAD: u64 = 128 << 20;
    // for work without large products
    const MIN_BYTES: u64 = 4 << 20;
    let Some(limit) = memory_limit() else { return u64::MAX };
    // memory freed by earlier solves is still resident but available, so the resident size is read only
    // once
    static BEFORE: OnceLock<u64> = OnceLock::new();
    let taken = PROGRAM + THREAD * rayon::current_num_threads() as u64 + BEFORE.get_or_init(resident);
    limit.saturating_sub(taken).max(MIN_BYTES)
}

/// Returns the bytes below the limit for a factor, next to a compiled graph whose H has `entries` entries.
pub(crate) fn beside(entries: usize) -> u64 {
    // graph, values, batches and fronts need up to eighteen times the memory of H
    const BESIDE: u64 = 18 * 16;
    below_limit().saturating_sub(BESIDE * entries as u64)
}

/// Returns the bytes available for a factor next to such a graph.
pub(crate) fn for_factor(entries: usize) -> u64 {
    available_memory().min(beside(entries))
}

/// Returns the resident bytes, without memory that the allocator has only reserved.
fn resident() -> u64 {
    const PAGE: u64 = 4096;
    // without this file the size is unknown, and zero is returned
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let resident = pages.split(' ').nth(1).and_then(|n| n.parse::<u64>().ok());
    resident.unwrap_or_default() * PAGE
}

/// Returns a lower bound of the bytes of a compiled graph, without the factor of its linear system.
pub(crate) fn of_graph(graph: &Graph, values: &Values) -> u64 {
    // keys, positions and the diagonal blocks of H
    const VARIABLE: u64 = 500;
    // its measurement, indices and slots
    const FACTOR: u64 = 400;
    let factors = graph.factors().iter().map(|entry| {
        let rows = entry.factor.erased().signature().rows.unwrap_or(0) as u64;
        // whitening matrices in graph and batch, and a block of H for each variable except one
        FACTOR + 8 * rows * rows * (1 + entry.keys.len() as u64)
    });
    factors.sum::<u64>() + VARIABLE * values.len() as u64
}
