//! Commands that read or write recordings.
mod doctor;
mod inspect;
mod simulate;
mod vio;

pub(crate) use doctor::Doctor;
pub(crate) use inspect::Inspect;
pub(crate) use simulate::Simulate;
pub(crate) use vio::Vio;
