//! Tests of mapping, from sequences to reports.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr
)]
mod association;
mod cameras;
mod completion;
mod evo;
mod ground_robots;
mod motion;
mod moved;
mod online;
mod pose_graph;
mod prior_map;
mod simulation;
mod tum;
mod variance;
