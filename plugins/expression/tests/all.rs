//! Formulas: their laws, and the text of each error message.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr
)]
mod bounds;
mod constraints;
mod fits;
mod laws;
mod long;
mod messages;
