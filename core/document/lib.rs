//! Documents as trees with text positions, and readers for types.
//!
//! A [`Node`] is a value with its [`Place`] in a [`SourceText`], independent of the format. [`Node::read`]
//! reads a serde type from it, and a [`Section`] reads a table field by field. All errors are collected in
//! [`Errors`]; each [`Diagnostic`] has a position and a remedy.
// documents are untrusted input, so indexing that can panic is not allowed
#![warn(clippy::indexing_slicing)]
mod diagnostic;
mod fault;
mod hand_over;
mod merge;
mod node;
mod read;
mod read_error;
mod reader;
mod renamed;
mod section;
mod source;
mod suggest;
mod text_error;

pub use diagnostic::{Diagnostic, Diagnostics, Errors};
pub use fault::{Fault, quoted_list};
pub use hand_over::{Placed, deserialize_with};
pub use merge::merge;
pub use node::{Field, MAX_DEPTH, Node, Table, Value};
pub use read_error::ReadError;
pub use reader::Reader;
pub use renamed::{RenamedField, read_renamed};
pub use section::Section;
pub use source::{Place, SourceText};
pub use suggest::{advice, nearest};
pub use text_error::TextError;
