//! The end of the program: exit codes, signals, unusable disks and folders, and the remaining files.
mod disk;
mod exit_codes;
pub(crate) mod interrupt;
pub(crate) mod killed;
mod overwriting;
pub(crate) mod repeated;
