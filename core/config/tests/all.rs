//! Tests of documents, from texts to graphs.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr
)]
mod formats;
mod graph_document;
mod overrides;
mod plugin;
mod properties;
mod reading;
mod schema;
