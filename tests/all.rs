//! Tests of the whole workspace: its layers, its catalogue, the links of its pages, numbers at their limits,
//! and the corpus of the fuzzers.
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
mod figures;
#[path = "fuzz/replay.rs"]
mod fuzz;
mod links;
mod numbers;
mod rooms;
