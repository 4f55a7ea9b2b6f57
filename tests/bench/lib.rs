//! Benchmark programs, and two data associations for comparison.
//!
//! `cargo run --release -p manifactor-bench -- measure NAME` runs the benchmark in `benchmarks/NAME.rs`.
//! They are commands of one program, because each program links the whole library.
//!
//! The associations `iou` and `projection` form an external plugin: they use only the public crates, and
//! register themselves by name. `cargo run --release -p manifactor-bench -- run RUN.toml` is the command
//! line that includes them.
mod overlap;

pub use overlap::{Iou, Projection};
