//! Experiments: the settings of one run, varied over axes, with a row for each trial.
//!
//! ```toml
//! title = "how much the noise of boxes matters"
//! base = "base.toml"                                  # a run; its variants are an axis of their own
//!
//! [[axes]]                                            # a column, and what it sets
//! columns = { sigma_px = "source.detector.sigma_px" }
//! rows = [1.0, 2.0, 4.0]
//!
//! [[axes]]                                            # several columns that change together
//! columns = { scene = "source.scene.seed", path = "source.trajectory.seed" }
//! rows = [[1, 11], [1, 12], [2, 21]]
//!
//! [[axes]]                                            # whole tables, by name
//! name = "model"
//! options = [{ name = "standard" }, { name = "truncated", set = { detections = { model = "truncated" } } }]
//!
//! [summary]                                           # means over all columns that are not named here
//! by = ["sigma_px", "model"]
//! baseline = { variant = "QuadricSLAM" }              # what each other variant is compared with, in pairs
//! clusters = ["scene"]                                # trials of one scene are not independent
//! metrics = ["position", "shape", "quality"]
//! ```
//! All combinations of all axes are run. Each [`Trial`] is solved on one thread, so that its result does not
//! depend on concurrent work. A finished trial is written to a [`TrialLog`] and is not run again. The tables
//! are made from this log.
mod document;
mod inputs;
mod journal;
mod measures;
mod output;
mod runner;
pub mod schema;
mod summary;
mod trial;

pub use document::{Experiment, ExperimentSources, Shard, ShardError, SummarySettings};
pub use journal::TrialLog;
pub use manifactor_metrics::{Interval, bootstrap};
pub use measures::measures;
pub use output::write;
pub use runner::{ExperimentProgress, run, run_single_threaded};
pub use summary::{Comparison, ExperimentSummary, TrialGroup, trials_table};
pub use trial::{Trial, TrialOutcome, TrialRecord};
