//! Means over trials, and differences between variants.
mod markdown;
mod table;

use crate::document::{Experiment, SummarySettings};
use crate::journal::TrialLog;
use crate::trial::{AT_JUMP, TrialRecord};
use indexmap::{IndexMap, IndexSet};
use manifactor_metrics::{Interval, bootstrap};
use serde::Serialize;
use table::records;

pub(crate) use table::times_table;
pub use table::trials_table;

/// Means and comparisons of all groups.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExperimentSummary {
    /// Title of the experiment.
    pub title: String,
    /// Columns that distinguish groups; the compared column is the last.
    pub columns: Vec<String>,
    /// Metrics that are averaged.
    pub metrics: Vec<String>,
    /// Column whose values are side by side in tables for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub across: Option<String>,
    /// Groups in the order of the table.
    pub groups: Vec<TrialGroup>,
    /// Number of trials that are not finished.
    pub open: usize,
}

/// Trials with equal values in the columns that distinguish groups.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialGroup {
    /// Labels, by column of the summary.
    pub labels: Vec<String>,
    /// Number of finished trials.
    pub trials: usize,
    /// Number of these trials without an estimate.
    pub failed: usize,
    /// Number of these trials whose solve ended without a minimum.
    pub not_converged: usize,
    /// Means by metric, if any trial has it.
    pub means: IndexMap<String, Interval>,
    /// Comparisons with the baseline by metric; empty for the baseline itself.
    pub comparisons: IndexMap<String, Comparison>,
}

/// Comparison of a variant with the baseline.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Comparison {
    /// Number of pairs of trials that are equal in all remaining columns and both have the metric.
    pub pairs: usize,
    /// Difference: variant minus baseline.
    pub difference: Interval,
    /// Mean of the baseline over these pairs.
    pub baseline: f64,
}

impl Comparison {
    /// Returns the mean difference as a share of the baseline's mean.
    pub fn relative(&self) -> f64 {
        self.difference.mean / self.baseline.abs()
    }
}

impl ExperimentSummary {
    /// Summarizes the finished trials.
    pub fn new(experiment: &Experiment, journal: &TrialLog) -> Self {
        let settings = &experiment.summary;
        let records: Vec<&TrialRecord> = records(experiment, journal).collect();
        let place = |name: &String| experiment.columns.iter().position(|column| column == name);
        let compared =
            settings.compared().and_then(|(column, value)| Some((place(&column.to_owned())?, value)));
        let mut by: Vec<usize> = settings.by.iter().filter_map(place).collect();
        by.extend(compared.map(|(column, _)| column).filter(|column| !by.contains(column)));
        let clusters: Vec<usize> = settings.clusters.iter().filter_map(place).collect();
        let over = SummaryBuilder { records: &records, by: &by, compared, clusters: &clusters, settings };

        let keys: IndexSet<Vec<&str>> = records.iter().map(|record| labels(record, &by)).collect();
        Self {
            title: experiment.title.clone(),
            columns: by.iter().filter_map(|i| experiment.columns.get(*i).cloned()).collect(),
            metrics: settings.metrics.clone(),
            across: settings.across.clone(),
            groups: keys.into_iter().map(|key| over.group(&key)).collect(),
            open: experiment.trials.len() - records.len(),
        }
    }
}

/// Returns the labels in some of the columns.
fn labels<'a>(record: &'a TrialRecord, columns: &[usize]) -> Vec<&'a str> {
    columns.iter().map(|i| record.labels.get(*i).map_or("", String::as_str)).collect()
}

struct SummaryBuilder<'a> {
    records: &'a [&'a TrialRecord],
    by: &'a [usize],
    /// The compared column, and the value of the baseline.
    compared: Option<(usize, &'a str)>,
    clusters: &'a [usize],
    settings: &'a SummarySettings,
}

impl<'a> SummaryBuilder<'a> {
    fn group(&self, key: &[&str]) -> TrialGroup {
        let members: Vec<&TrialRecord> =
            self.records.iter().copied().filter(|record| labels(record, self.by) == key).collect();
        let count = |status: fn(&str) -> bool| members.iter().filter(|r| status(r.outcome.status())).count();
        let is_baseline = self.compared.is_none_or(|(column, value)| {
            members.first().and_then(|r| r.labels.get(column)).is_some_and(|label| label == value)
        });
        let metrics = || self.settings.metrics.iter();
        let mean = |metric: &String| Some((metric.clone(), self.mean(&members, metric)?));
        let compare = |metric: &String| Some((metric.clone(), self.compare(&members, metric)?));
        TrialGroup {
            labels: key.iter().map(|label| (*label).to_owned()).collect(),
            trials: members.len(),
            failed: count(|status| status == "failed"),
            not_converged: count(|status| !["failed", "converged", AT_JUMP].contains(&status)),
            means: metrics().filter_map(mean).collect(),
            comparisons: metrics().filter(|_| !is_baseline).filter_map(compare).collect(),
        }
    }

    fn mean(&self, members: &[&'a TrialRecord], metric: &str) -> Option<Interval> {
        let values =
            members.iter().filter_map(|record| Some((*record, record.outcome.measure_by_name(metric)?)));
        self.interval(values)
    }

    fn compare(&self, members: &[&'a TrialRecord], metric: &str) -> Option<Comparison> {
        let (column, value) = self.compared?;
        let key = |record: &'a TrialRecord, label: &'a str| -> Vec<&'a str> {
            let labels = record.labels.iter().enumerate();
            labels.map(|(i, own)| if i == column { label } else { own.as_str() }).collect()
        };
        let all: IndexMap<Vec<&str>, &TrialRecord> =
            self.records.iter().map(|record| (labels(record, &every(record)), *record)).collect();
        let pairs: Vec<(&TrialRecord, f64, f64)> = members
            .iter()
            .filter_map(|record| {
                let baseline = all.get(&key(record, value))?.outcome.measure_by_name(metric)?;
                Some((*record, record.outcome.measure_by_name(metric)?, baseline))
            })
            .collect();
        let difference =
            self.interval(pairs.iter().map(|(record, own, baseline)| (*record, own - baseline)))?;
        let baseline = pairs.iter().map(|(_, _, baseline)| baseline).sum::<f64>() / pairs.len() as f64;
        Some(Comparison { pairs: pairs.len(), difference, baseline })
    }

    fn interval(&self, values: impl Iterator<Item = (&'a TrialRecord, f64)>) -> Option<Interval> {
        let mut clusters: IndexMap<Vec<&str>, Vec<f64>> = IndexMap::new();
        for (record, value) in values {
            let key = if self.clusters.is_empty() {
                labels(record, &every(record))
            } else {
                labels(record, self.clusters)
            };
            clusters.entry(key).or_default().push(value);
        }
        let clusters: Vec<Vec<f64>> = clusters.into_values().collect();
        bootstrap(&clusters, *self.settings.resamples, self.settings.seed)
    }
}

fn every(record: &TrialRecord) -> Vec<usize> {
    (0..record.labels.len()).collect()
}
