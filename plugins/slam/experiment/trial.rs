//! A trial and its outcome.
use crate::measures::measures;
use indexmap::IndexMap;
use manifactor_mapping::settings::RunSettings;
use manifactor_recording::source::InputFolders;
use manifactor_run::run::{RunError, estimate};
use manifactor_solve::{Observer, Stall, Termination};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Instant;

/// One cell of an experiment's grid.
#[derive(Debug, Clone)]
pub struct Trial {
    /// Labels, by column of the experiment.
    pub labels: Vec<String>,
    /// Complete settings.
    pub settings: RunSettings,
    /// Hash of the input files, see [`Experiment::open_inputs`](crate::Experiment::open_inputs); 0 without files.
    pub inputs: u64,
}

/// Outcome of a trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum TrialOutcome {
    /// The trial was solved, to a minimum or not: see `termination`.
    Solved {
        /// Termination of the solve: `converged`, `stalled`, `stalled_at_jump`, `max_iterations` and so on.
        termination: String,
        /// Finite measures by name.
        measures: IndexMap<String, f64>,
    },
    /// There is no estimate.
    Failed {
        /// The reason.
        reason: String,
    },
}

/// A finished trial: one line of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialRecord {
    /// Labels, by column of the experiment.
    pub labels: Vec<String>,
    /// Fingerprint of the settings and the input files; with others, it is a different trial.
    pub fingerprint: String,
    /// Outcome of the trial.
    pub outcome: TrialOutcome,
    /// Duration, which differs between runs, so tables of results do not contain it. Unit: seconds.
    pub seconds: f64,
}

impl Trial {
    /// Returns the fingerprint of its [settings](RunSettings::fingerprint) and of its input files.
    pub fn fingerprint(&self) -> String {
        let settings = self.settings.fingerprint();
        if self.inputs == 0 { settings } else { format!("{settings}-{:016x}", self.inputs) }
    }

    /// Runs the trial; `None` if the observer stopped it. Errors become the outcome.
    pub fn run(&self, folders: &InputFolders, observer: &mut dyn Observer) -> Option<TrialRecord> {
        let clock = Instant::now();
        let outcome = match self.solve(folders, observer) {
            Ok(outcome) => outcome?,
            Err(error) => TrialOutcome::Failed { reason: error.to_string() },
        };
        let (labels, fingerprint) = (self.labels.clone(), self.fingerprint());
        Some(TrialRecord { labels, fingerprint, outcome, seconds: clock.elapsed().as_secs_f64() })
    }

    fn solve(
        &self,
        folders: &InputFolders,
        observer: &mut dyn Observer,
    ) -> Result<Option<TrialOutcome>, RunError> {
        let sequence = Arc::new(self.settings.source.load(folders)?);
        let (estimate, report) = estimate("trial", sequence, &self.settings, observer)?;
        let termination = &report.solve.termination;
        if *termination == Termination::Interrupted {
            return Ok(None);
        }
        let measures = measures(&estimate, &report);
        Ok(Some(TrialOutcome::Solved { termination: status(termination), measures }))
    }
}

/// Name of the end at a jump or a kink of the cost, which is as good as a minimum.
pub(crate) const AT_JUMP: &str = "stalled_at_jump";

/// Returns the name of a termination in documents.
fn status(termination: &Termination) -> String {
    if let Termination::Stalled { reason: Stall::Jump } = termination {
        return AT_JUMP.to_owned();
    }
    let json = serde_json::to_value(termination).unwrap_or_default();
    json.get("status").and_then(|s| s.as_str()).unwrap_or("unknown").to_owned()
}
