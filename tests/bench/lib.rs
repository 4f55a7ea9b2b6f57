//! Benchmark programs, and two data associations for comparison.
//!
//! Each file in `examples` prints a table of the pages in `docs/`; its first lines describe its arguments:
//! `cargo run --release -p manifactor-bench --example NAME`.
//!
//! The associations `iou` and `projection` form an external plugin: they use only the public crates, and
//! register themselves by name. `cargo run --release -p manifactor-bench -- run RUN.toml` is the command
//! line that includes them.
mod overlap;

pub use overlap::{Iou, Projection};
