//! Graph documents: all variables and factors by key, in TOML, JSON or YAML.
mod check;
mod each;
mod read;
mod write;

pub(crate) use read::{FactorDocument, VariableDocument};
pub use read::{read_graph, read_graph_section};
pub use write::write_graph;
