//! What a command line names: files of graphs and runs, solvers, and changes to either.
pub(crate) mod choice;
pub(crate) mod graph_file;
pub(crate) mod run_file;
pub(crate) mod solver;
pub(crate) mod what_if;
