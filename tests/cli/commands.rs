//! Each command: its arguments and its results.
mod check;
mod documents;
pub(crate) mod experiment;
mod graph;
mod laws;
mod maps;
mod names;
mod new;
pub(crate) mod online;
mod recordings;
mod replay;
mod run;
mod schema;
mod solve;
