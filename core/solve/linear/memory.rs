//! How much memory there is, and how much a graph takes.
use manifactor_graph::{Graph, Values};
use std::fmt;
use std::sync::OnceLock;

/// A number of bytes, as people say it: `12.0 MiB`, `1.50 GiB`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bytes(pub u64);

impl fmt::Display for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mib = self.0 as f64 / f64::from(1 << 20);
        if mib < 1024.0 { write!(f, "{mib:.1} MiB") } else { write!(f, "{:.2} GiB", mib / 1024.0) }
    }
}

/// Bytes that this process can still have: what the system has left, or the limit that it was given.
pub fn available_memory() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let left = system.available_memory();
    let left = system.cgroup_limits().map_or(left, |limits| left.min(limits.free_memory));
    left.min(below_limit())
}

/// The most address space that this process may have, in bytes (`ulimit -v`); `None` if no limit is set.
#[cfg(unix)]
pub fn memory_limit() -> Option<u64> {
    rustix::process::getrlimit(rustix::process::Resource::As).current
}

/// The most address space that this process may have, in bytes: no limit is known on this system.
#[cfg(not(unix))]
pub fn memory_limit() -> Option<u64> {
    None
}

/// Bytes that a limit leaves; all that there are, where there is none. Rather too few than too many: an allocator that
/// finds nothing ends the program.
pub(crate) fn below_limit() -> u64 {
    // a limit is on addresses: those of code and of the main thread count, and for each of the others what its allocator
    // sets aside, and the buffer of a large product
    const PROGRAM: u64 = 288 << 20;
    const THREAD: u64 = 128 << 20;
    // for what has no large products
    const LEAST: u64 = 4 << 20;
    let Some(limit) = memory_limit() else { return u64::MAX };
    // memory that earlier solves have freed is still resident but available: ask once
    static BEFORE: OnceLock<u64> = OnceLock::new();
    let taken = PROGRAM + THREAD * rayon::current_num_threads() as u64 + BEFORE.get_or_init(resident);
    limit.saturating_sub(taken).max(LEAST)
}

/// Bytes that a limit leaves for a factor beside a compiled graph whose H has `entries` entries.
pub(crate) fn beside(entries: usize) -> u64 {
    // graph, values, batches and fronts take up to eighteen times what H does
    const BESIDE: u64 = 18 * 16;
    below_limit().saturating_sub(BESIDE * entries as u64)
}

/// Bytes that there are for a factor beside such a graph.
pub(crate) fn for_factor(entries: usize) -> u64 {
    available_memory().min(beside(entries))
}

/// Bytes in use, without what the allocator has reserved beyond that.
fn resident() -> u64 {
    const PAGE: u64 = 4096;
    // without such a file it is unknown
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let resident = pages.split(' ').nth(1).and_then(|n| n.parse::<u64>().ok());
    resident.unwrap_or_default() * PAGE
}

/// Bytes that a compiled graph takes, without the factor of its linear system: at least.
pub(crate) fn of_graph(graph: &Graph, values: &Values) -> u64 {
    // keys, places and the blocks of H on the diagonal
    const VARIABLE: u64 = 500;
    // its measurement, indices and slots
    const FACTOR: u64 = 400;
    let factors = graph.factors().iter().map(|entry| {
        let rows = entry.factor.erased().signature().rows.unwrap_or(0) as u64;
        // whitening twice, looked up and by batch, and a block of H with each variable but one
        FACTOR + 8 * rows * rows * (1 + entry.keys.len() as u64)
    });
    factors.sum::<u64>() + VARIABLE * values.len() as u64
}
