//! How the program ends: exit codes, signals, disks and folders that do not serve; and what is left then.
mod disk;
mod exit_codes;
pub(crate) mod interrupt;
pub(crate) mod killed;
mod overwriting;
pub(crate) mod repeated;
