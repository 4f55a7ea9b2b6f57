//! Tables of all finished trials, in the order of the experiment.
use crate::document::Experiment;
use crate::journal::TrialLog;
use crate::trial::{TrialOutcome, TrialRecord};
use indexmap::IndexSet;
use manifactor_formats::table::{DataColumn, DataTable};

/// Returns a row for each finished trial: its columns, `status` (`failed`, or the termination of the solve),
/// the `reason` of a failure, and every measure that any trial has.
///
/// The rows have the order of the experiment and contain no times. The table is therefore independent of
/// interruptions and of the number of threads.
pub fn trials_table(experiment: &Experiment, journal: &TrialLog) -> DataTable {
    let records: Vec<&TrialRecord> = records(experiment, journal).collect();
    let measures: IndexSet<&str> =
        records.iter().flat_map(|r| r.outcome.measures()).map(|(name, _)| name).collect();
    let mut columns = labels(experiment, &records);
    let text = |of: fn(&TrialOutcome) -> &str| {
        DataColumn::Text(records.iter().map(|record| of(&record.outcome).to_owned()).collect())
    };
    columns.push(("status".to_owned(), text(TrialOutcome::status)));
    columns.push(("reason".to_owned(), text(TrialOutcome::reason)));
    for measure in measures {
        let cells = records.iter().map(|record| record.outcome.measure_by_name(measure)).collect();
        columns.push((measure.to_owned(), DataColumn::Number(cells)));
    }
    DataTable { columns }
}

/// Returns the duration of each trial in seconds.
pub(crate) fn times_table(experiment: &Experiment, journal: &TrialLog) -> DataTable {
    let records: Vec<&TrialRecord> = records(experiment, journal).collect();
    let mut columns = labels(experiment, &records);
    let seconds = records.iter().map(|record| Some(record.seconds)).collect();
    columns.push(("seconds".to_owned(), DataColumn::Number(seconds)));
    DataTable { columns }
}

/// Returns the finished trials in the order of the experiment.
pub(super) fn records<'a>(
    experiment: &'a Experiment,
    journal: &'a TrialLog,
) -> impl Iterator<Item = &'a TrialRecord> {
    experiment.trials.iter().filter_map(|trial| journal.record_of(trial))
}

fn labels(experiment: &Experiment, records: &[&TrialRecord]) -> Vec<(String, DataColumn)> {
    let label =
        |i: usize| records.iter().map(|record| record.labels.get(i).cloned().unwrap_or_default()).collect();
    let columns = experiment.columns.iter().enumerate();
    columns.map(|(i, name)| (name.clone(), DataColumn::Text(label(i)))).collect()
}

impl TrialOutcome {
    /// Returns `failed`, or the termination of the solve.
    pub fn status(&self) -> &str {
        match self {
            Self::Solved { termination, .. } => termination,
            Self::Failed { .. } => "failed",
        }
    }

    /// Returns the reason of a failure; empty if the trial did not fail.
    pub fn reason(&self) -> &str {
        match self {
            Self::Solved { .. } => "",
            Self::Failed { reason } => reason,
        }
    }

    /// Returns the measures in order.
    pub fn measures(&self) -> impl Iterator<Item = (&str, f64)> {
        let measures = match self {
            Self::Solved { measures, .. } => Some(measures),
            Self::Failed { .. } => None,
        };
        measures.into_iter().flatten().map(|(name, value)| (name.as_str(), *value))
    }

    /// Returns one measure; `None` if it is unknown.
    pub(crate) fn measure_by_name(&self, name: &str) -> Option<f64> {
        match self {
            Self::Solved { measures, .. } => measures.get(name).copied(),
            Self::Failed { .. } => None,
        }
    }
}
