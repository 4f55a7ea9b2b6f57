//! A factor that is written as formulas in a config.
//!
//! Formulas are parsed, checked and compiled once, to a program of calls over flat values. The program runs
//! over numbers and over dual numbers. The crates that define the types register the functions: see
//! [`manifactor_graph::quantity`].
// Formulas are untrusted input: no index is taken for granted.
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
