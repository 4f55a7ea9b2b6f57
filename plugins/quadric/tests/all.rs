//! Quadrics: against another implementation, in whole solves, and in the catalogue.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr
)]
mod catalogue;
mod conformance;
mod indeterminate;
mod scene;
mod solving;
mod threads;
