//! The commands: one file for each, with its arguments and its implementation.
mod about;
mod check;
mod evaluate;
pub(crate) mod experiment;
mod graph;
mod laws;
mod new;
mod online;
mod plot;
mod replay;
mod run;
mod simulate;
mod solve;

pub(crate) use about::{Completions, Explain, List, Man, Schema};
pub(crate) use check::Check;
pub(crate) use evaluate::Evaluate;
pub(crate) use experiment::Experiment;
pub(crate) use graph::ShowGraph;
pub(crate) use laws::{CheckFactor, CheckManifold};
pub(crate) use new::New;
pub(crate) use online::Online;
pub(crate) use plot::Plot;
pub(crate) use replay::Replay;
pub(crate) use run::Run;
pub(crate) use simulate::Simulate;
pub(crate) use solve::Solve;
