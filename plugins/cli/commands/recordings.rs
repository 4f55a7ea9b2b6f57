//! Commands that read or write recordings.
mod inspect;
mod simulate;

pub(crate) use inspect::Inspect;
pub(crate) use simulate::Simulate;
