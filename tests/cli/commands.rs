//! Each command: its arguments and its results.
mod check;
mod documents;
mod evaluate;
pub(crate) mod experiment;
mod graph;
mod laws;
mod maps;
mod names;
mod new;
pub(crate) mod online;
mod replay;
mod run;
mod schema;
mod solve;
