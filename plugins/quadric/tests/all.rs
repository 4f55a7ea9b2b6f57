//! Quadrics: comparison with another implementation, full solves, and the catalogue.
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
