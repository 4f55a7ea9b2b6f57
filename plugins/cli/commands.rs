//! The commands, a file each: what it takes, and what it does.
mod check;
mod check_factor;
mod evaluate;
mod experiment;
mod explain;
mod graph;
mod list;
mod new;
mod pictures;
mod plot;
mod run;
mod schema;
mod simulate;
mod solve;

pub(crate) use check::Check;
pub(crate) use check_factor::CheckFactor;
pub(crate) use evaluate::Evaluate;
pub(crate) use experiment::Experiment;
pub(crate) use explain::Explain;
pub(crate) use graph::ShowGraph;
pub(crate) use list::List;
pub(crate) use new::New;
pub(crate) use plot::Plot;
pub(crate) use run::Run;
pub(crate) use schema::Schema;
pub(crate) use simulate::Simulate;
pub(crate) use solve::Solve;
