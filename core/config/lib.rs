//! Documents in TOML, JSON and YAML, with errors that name the line.
//!
//! A [`Document`] is a tree of [`Node`]s with [`Place`]s, independent of the format. A [`Section`] reads a
//! table field by field, both serde types and registered trait objects, and collects all errors in
//! [`Errors`]. [`Diagnostics`] is the list of these errors, each with its position and a remedy.
//! [`read_graph`] and [`write_graph`] read and write graph documents, and [`graph_schema`] describes these to
//! editors.
// documents are untrusted input, so indexing that can panic is not allowed
#![warn(clippy::indexing_slicing)]
mod document;
mod format;
mod graph_document;
mod overrides;
mod schema;
mod write;

pub use document::Document;
pub use format::{Format, MAX_BYTES};
pub use graph_document::{read_graph, read_graph_section, write_graph};
pub use manifactor_document::{
    Diagnostic, Diagnostics, Errors, Fault, Field, MAX_DEPTH, Node, Place, Placed, ReadError, Reader,
    Section, SourceText, Table, Value, deserialize_with, merge, nearest, quoted_list,
};
pub use schema::{Definitions, graph_root, graph_schema};
pub use write::{WriteError, to_json, to_toml, to_yaml};
