//! Arguments that name the input: files of graphs and runs, solvers, changes to either, and the style of
//! pictures.
pub(crate) mod choice;
pub(crate) mod destination;
pub(crate) mod document;
pub(crate) mod graph_file;
pub(crate) mod kind;
pub(crate) mod pictures;
pub(crate) mod recording;
pub(crate) mod run_file;
pub(crate) mod solver;
pub(crate) mod what_if;
