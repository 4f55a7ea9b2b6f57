//! Documents as trees that know their places, and types read out of them.
//!
//! A [`Node`] is a value and its [`Place`] in a [`SourceText`], the same for all formats. [`Node::read`] reads a serde type out
//! of it; a [`Section`] reads a table field by field. Everything that is wrong is collected in [`Errors`], and each
//! [`Diagnostic`] has its place and what to do about it.
// strangers' input comes in here: no place of it is taken for granted
#![warn(clippy::indexing_slicing)]
mod diagnostic;
mod fault;
mod hand_over;
mod merge;
mod node;
mod read;
mod read_error;
mod reader;
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
pub use section::Section;
pub use source::{Place, SourceText};
pub use suggest::{advice, nearest};
pub use text_error::TextError;
