//! Each command: what it takes, and what it does.
mod check_factor;
mod documents;
mod evaluate;
pub(crate) mod experiment;
mod graph;
mod names;
mod new;
mod replay;
mod run;
mod schema;
mod solve;
