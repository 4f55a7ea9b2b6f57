//! One trial, and what it came to.
use crate::measures::measures;
use indexmap::IndexMap;
use manifactor_mapping::settings::Settings;
use manifactor_recording::source::Folders;
use manifactor_run::run::{RunError, estimate};
use manifactor_solve::{Observer, Termination};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Instant;

/// One cell of an experiment.
#[derive(Debug, Clone)]
pub struct Trial {
    /// By column of the experiment.
    pub labels: Vec<String>,
    /// Its settings, complete.
    pub settings: Settings,
}

/// What a trial came to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "status", rename_all = "snake_case")]
pub enum TrialOutcome {
    /// It was solved, to a minimum or not: see `termination`.
    Solved {
        /// How the solve ended: `converged`, `stalled`, `max_iterations` and so on.
        termination: String,
        /// What is measured of it, by name; finite numbers.
        measures: IndexMap<String, f64>,
    },
    /// There is no estimate.
    Failed {
        /// Why.
        reason: String,
    },
}

/// A trial that is done: a line of the journal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TrialRecord {
    /// By column of the experiment.
    pub labels: Vec<String>,
    /// Of the settings; other settings are another trial.
    pub fingerprint: String,
    /// What it came to.
    pub outcome: TrialOutcome,
    /// How long it took. No two runs agree in it, so it is in no table of results.
    pub seconds: f64,
}

impl Trial {
    /// That of its [settings](Settings::fingerprint).
    pub fn fingerprint(&self) -> String {
        self.settings.fingerprint()
    }

    /// Runs it; `None` where the observer stopped it. Whatever goes wrong is an outcome.
    pub fn run(&self, folders: &Folders, observer: &mut dyn Observer) -> Option<TrialRecord> {
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
        folders: &Folders,
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

/// The name of an ending, as documents write it.
fn status(termination: &Termination) -> String {
    let json = serde_json::to_value(termination).unwrap_or_default();
    json.get("status").and_then(|s| s.as_str()).unwrap_or("unknown").to_owned()
}
