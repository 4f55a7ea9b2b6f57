//! Documents in TOML, JSON and YAML, and errors that point at the line.
//!
//! A [`Document`] is a tree of [`Node`]s that know their [`Place`]s, the same for all formats. A [`Section`] reads a
//! table of it field by field, serde types and registered trait objects alike, and collects in [`Errors`] everything
//! that is wrong; [`Diagnostics`] is that list, each entry with its place and what to do about it.
//! [`read_graph`] and [`write_graph`] are the two ways of a literal graph, [`graph_schema`] describes it to editors.
// strangers' input comes in here: no place of it is taken for granted
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
