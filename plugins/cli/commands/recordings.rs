//! Commands that read or write recordings.
mod inspect;
mod simulate;
mod vio;

pub(crate) use inspect::Inspect;
pub(crate) use simulate::Simulate;
pub(crate) use vio::Vio;
