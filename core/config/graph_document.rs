//! The literal graph: every variable and every factor by key, in TOML, JSON or YAML.
//!
//! ```toml
//! [[variables]]
//! key = "x0"
//! value = { type = "se2", x = 0.0, y = 0.0, theta = 0.0 }
//! fixed = true                                   # or the names of some directions of its tangent space
//!
//! [[factors]]
//! keys = ["x0", "x1"]
//! factor = { type = "between_se2", x = 1.0, y = 0.0, theta = 0.1 }
//! noise = { sigmas = [0.1, 0.1, 0.02] }          # unit, where it is left out
//! loss = { type = "huber", k = 1.345 }           # none, where it is left out
//! ```
//!
//! What [`write_graph`] writes, [`read_graph`] reads back to the last bit.
mod check;
mod read;
mod write;

pub use read::{read_graph, read_graph_section};
pub use write::write_graph;
