//! Solvers on poses and points, and the catalogue of the crate.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr
)]
mod auto;
mod catalogue;
mod linear_solvers;
mod scale;
mod time_offset;
mod valleys;
