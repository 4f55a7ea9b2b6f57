//! The workspace as a whole: its layers, its catalogue, numbers at their limits, and the fuzzers' corpus.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr
)]
mod architecture;
mod catalogue;
mod expression;
#[path = "fuzz/replay.rs"]
mod fuzz;
mod numbers;
mod rooms;
