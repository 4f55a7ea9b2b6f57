//! Files are read, written and solved.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr
)]
mod auto;
mod bal;
mod colmap;
mod gnc;
mod online;
mod pose_graphs;
mod published_graphs;
mod published_sequences;
mod round_trip;
mod starts;
