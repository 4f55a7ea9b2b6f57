//! What people and machines get wrong in files, and what the binary says to it.
//!
//! Each case is a file; its snapshot is the exit code and the message, to be read as a user would. All of them run under a
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
