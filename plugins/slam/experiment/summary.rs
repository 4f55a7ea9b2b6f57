//! Means over trials, and how far variants are apart.
mod markdown;
mod table;

use crate::document::{Experiment, SummarySettings};
use crate::journal::TrialLog;
use crate::trial::TrialRecord;
use indexmap::{IndexMap, IndexSet};
use manifactor_metrics::{Interval, bootstrap};
use serde::Serialize;
use table::records;

pub(crate) use table::times_table;
pub use table::trials_table;

/// Means and comparisons, group by group.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// What the experiment is called.
    pub title: String,
    /// The columns that tell groups apart, the one compared last.
    pub columns: Vec<String>,
    /// What is averaged.
    pub metrics: Vec<String>,
    /// The column whose values stand side by side in tables for people.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub across: Option<String>,
    /// In the order of the table.
    pub groups: Vec<Group>,
    /// Trials that are not done yet.
    pub open: usize,
}

/// Trials that are alike in the columns that are kept apart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Group {
    /// By column of the summary.
    pub labels: Vec<String>,
    /// Trials done.
    pub trials: usize,
    /// Of them, those without an estimate.
    pub failed: usize,
    /// Of them, those whose solve ended without a minimum.
    pub not_converged: usize,
    /// By metric, where any trial has it.
    pub means: IndexMap<String, Interval>,
    /// Against the baseline, by metric; empty for the baseline itself.
    pub comparisons: IndexMap<String, Comparison>,
}

/// A variant against the baseline.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Comparison {
    /// Pairs of trials that are alike in all other columns, both with the metric.
    pub pairs: usize,
    /// The variant less the baseline.
    pub difference: Interval,
    /// The baseline's mean over the same pairs.
    pub baseline: f64,
}

impl Comparison {
    /// The mean difference as a share of the baseline's mean.
    pub fn relative(&self) -> f64 {
        self.difference.mean / self.baseline.abs()
    }
}

impl Summary {
    /// Over the trials that are done.
    pub fn new(experiment: &Experiment, journal: &TrialLog) -> Self {
        let settings = &experiment.summary;
        let records: Vec<&TrialRecord> = records(experiment, journal).collect();
        let place = |name: &String| experiment.columns.iter().position(|column| column == name);
        let compared =
            settings.compared().and_then(|(column, value)| Some((place(&column.to_owned())?, value)));
        let mut by: Vec<usize> = settings.by.iter().filter_map(place).collect();
        by.extend(compared.map(|(column, _)| column).filter(|column| !by.contains(column)));
        let clusters: Vec<usize> = settings.clusters.iter().filter_map(place).collect();
        let over = Over { records: &records, by: &by, compared, clusters: &clusters, settings };

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

/// Labels in some of the columns.
fn labels<'a>(record: &'a TrialRecord, columns: &[usize]) -> Vec<&'a str> {
    columns.iter().map(|i| record.labels.get(*i).map_or("", String::as_str)).collect()
}

struct Over<'a> {
    records: &'a [&'a TrialRecord],
    by: &'a [usize],
    /// The column that is compared, and the value of the baseline.
    compared: Option<(usize, &'a str)>,
    clusters: &'a [usize],
    settings: &'a SummarySettings,
}

impl<'a> Over<'a> {
    fn group(&self, key: &[&str]) -> Group {
        let members: Vec<&TrialRecord> =
            self.records.iter().copied().filter(|record| labels(record, self.by) == key).collect();
        let count = |status: fn(&str) -> bool| members.iter().filter(|r| status(r.outcome.status())).count();
        let is_baseline = self.compared.is_none_or(|(column, value)| {
            members.first().and_then(|r| r.labels.get(column)).is_some_and(|label| label == value)
        });
        let metrics = || self.settings.metrics.iter();
        let mean = |metric: &String| Some((metric.clone(), self.mean(&members, metric)?));
        let compare = |metric: &String| Some((metric.clone(), self.compare(&members, metric)?));
        Group {
            labels: key.iter().map(|label| (*label).to_owned()).collect(),
            trials: members.len(),
            failed: count(|status| status == "failed"),
            not_converged: count(|status| !["failed", "converged", "stalled"].contains(&status)),
            means: metrics().filter_map(mean).collect(),
            comparisons: metrics().filter(|_| !is_baseline).filter_map(compare).collect(),
        }
    }

    fn mean(&self, members: &[&'a TrialRecord], metric: &str) -> Option<Interval> {
        let values = members.iter().filter_map(|record| Some((*record, record.outcome.measure(metric)?)));
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
                let baseline = all.get(&key(record, value))?.outcome.measure(metric)?;
                Some((*record, record.outcome.measure(metric)?, baseline))
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
