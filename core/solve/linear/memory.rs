//! How much memory there is, and how much a graph takes.
use manifactor_graph::{Graph, Values};

/// Bytes that this process can still have: what the system has left, or the limit that it was given.
pub fn available_memory() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let left = system.available_memory();
    let left = system.cgroup_limits().map_or(left, |limits| left.min(limits.free_memory));
    left.min(below_limit())
}

/// The most address space that this process may have, in bytes (`ulimit -v`); `None` where nobody has set a limit.
#[cfg(unix)]
pub fn memory_limit() -> Option<u64> {
    rustix::process::getrlimit(rustix::process::Resource::As).current
}

/// The most address space that this process may have, in bytes: nobody knows of a limit.
#[cfg(not(unix))]
pub fn memory_limit() -> Option<u64> {
    None
}

/// Bytes that a limit leaves; all that there are, where there is none.
pub(crate) fn below_limit() -> u64 {
    // a limit is on addresses: stacks and code count, and the buffers that a dense product takes on each thread
    const STACKS_AND_CODE: u64 = 96 << 20;
    const BUFFERS: u64 = 64 << 20;
    let Some(limit) = memory_limit() else { return u64::MAX };
    let reserved = STACKS_AND_CODE + BUFFERS * rayon::current_num_threads() as u64;
    limit.saturating_sub(reserved + resident())
}

/// Bytes in use. What an allocator has reserved beyond that is still to be had.
fn resident() -> u64 {
    const PAGE: u64 = 4096;
    // where there is no such file, nobody knows
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
