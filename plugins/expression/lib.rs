//! A factor that is written as a formula in a config.
//!
//! A formula is parsed, checked and compiled once, to a program of calls over flat
//! values, which runs over numbers and over dual numbers. What it can call is registered by the crate with the geometry:
//! see [`manifactor_graph::quantity`].
// strangers' input comes in here: no place of it is taken for granted
#![warn(clippy::indexing_slicing)]
mod cache;
#[allow(clippy::indexing_slicing, reason = "a formula is checked by now")]
mod compile;
mod constant;
mod expression;
#[allow(clippy::indexing_slicing, reason = "vectors have an entry")]
mod functions;
mod language;
mod mistake;
#[allow(clippy::indexing_slicing, reason = "a formula is checked by now")]
mod program;
mod resolve;
mod scope;
mod syntax;

pub use constant::Constant;
pub use expression::{Expression, ExpressionError};
pub use program::Program;
