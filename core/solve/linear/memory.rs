//! How much memory there is.

/// Bytes that this process can still have: what the system has left, or the limit that it was given.
pub(crate) fn available() -> u64 {
    let mut system = sysinfo::System::new();
    system.refresh_memory();
    let left = system.available_memory();
    system.cgroup_limits().map_or(left, |limits| left.min(limits.free_memory))
}
