//! How much memory there is.

/// Bytes that this process can still have: what the system has left, or the limit that it was given.
pub fn available_memory() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let left = system.available_memory();
    let left = system.cgroup_limits().map_or(left, |limits| left.min(limits.free_memory));
    left.min(below_limit())
}

/// Bytes below the limit of the address space (`ulimit -v`); all that there are, where there is none.
#[cfg(unix)]
pub(crate) fn below_limit() -> u64 {
    use rustix::process::{Resource, getrlimit};
    let Some(limit) = getrlimit(Resource::As).current else { return u64::MAX };
    limit.saturating_sub(taken())
}

/// Nobody knows of one.
#[cfg(not(unix))]
pub(crate) fn below_limit() -> u64 {
    u64::MAX
}

/// Bytes that are in use, and those that no heap can have: stacks, code. An allocator's own reserve is still to be had.
#[cfg(unix)]
fn taken() -> u64 {
    const STACKS_AND_CODE: u64 = 96 << 20;
    const PAGE: u64 = 4096;
    // where there is no such file, at least these
    let pages = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let resident = pages.split(' ').nth(1).and_then(|n| n.parse::<u64>().ok()).unwrap_or_default();
    STACKS_AND_CODE + resident * PAGE
}
