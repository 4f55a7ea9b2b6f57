//! Programs that measure: each file in `examples` prints a table of the pages in `docs/`.
//!
//! `cargo run --release -p manifactor-bench --example NAME` runs one; its first lines say which arguments it takes.
