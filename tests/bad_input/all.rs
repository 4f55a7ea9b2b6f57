//! Mistakes in files, by people and machines, and the answers of the binary.
//!
//! Each case is a file. Its snapshot is the exit code and the message, for review from a user's point of
//! view. All cases run with a limit of memory and time, and none may panic.
//! limit of memory and of time, and none may panic.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]
mod bundles;
mod detections;
mod graphs;
mod harness;
mod json;
mod pose_graphs;
mod runs;
mod trajectories;
mod yaml;
