//! One run: from a document to a map, a report and the files of its folder.
//!
//! [`Run`](run::Run) carries out a [run document](manifactor_mapping::run_document); [`report`] compares the estimates with the ground
//! truth; [`output`] writes the files.
pub mod output;
pub mod run;

pub use output::{record, report};
