//! Programs that measure, and two data associations to compare with.
//!
//! Each file in `examples` prints a table of the pages in `docs/`; its first lines say which arguments it takes:
//! `cargo run --release -p manifactor-bench --example NAME`.
//!
//! The associations `iou` and `projection` are a plugin outside of Manifactor: they use the public crates alone, and
//! register themselves by name. `cargo run --release -p manifactor-bench -- run RUN.toml` is the command line that knows
//! them.
mod overlap;

pub use overlap::{Iou, Projection};
