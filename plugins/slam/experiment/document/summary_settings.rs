use crate::measures::measure_names_in_words;
use indexmap::IndexMap;
use manifactor_graph::checked::Count;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[summary]`: means over trials, and comparisons with a baseline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SummarySettings {
    /// Columns that distinguish groups of trials.
    pub by: Vec<String>,
    /// A column and one of its values, the baseline. Every further value is compared with it, over pairs of
    /// trials that are equal in all remaining columns.
    #[schemars(with = "std::collections::HashMap<String, String>")]
    pub baseline: IndexMap<String, String>,
    /// Trials with equal values in these columns form a cluster and are resampled together. Default: each
    /// trial is a cluster.
    pub clusters: Vec<String>,
    /// Metrics to average: columns of measures.
    #[schemars(extend("description" = described()))]
    pub metrics: Vec<String>,
    /// A column in `by` whose values are side by side in `summary.md`: each metric has one column of the
    /// table for each value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub across: Option<String>,
    /// A numeric column in `by` that is the horizontal axis of the metrics in reports.
    pub curve: Option<String>,
    /// Number of bootstrap resamples. At most a million, at which the ends of an interval are accurate to a
    /// thousandth of its width.
    pub resamples: Count<0, 1_000_000>,
    /// Seed of the resampling.
    pub seed: u64,
}

impl Default for SummarySettings {
    fn default() -> Self {
        Self {
            by: vec![],
            baseline: IndexMap::new(),
            clusters: vec![],
            metrics: vec![],
            across: None,
            curve: None,
            resamples: Count::literal(10_000),
            seed: 1,
        }
    }
}

/// Returns the description of `metrics`, with all names.
fn described() -> String {
    format!("Measures to average: {}.", measure_names_in_words())
}

impl SummarySettings {
    /// Returns the column whose values are compared, and the value of the baseline.
    pub fn compared(&self) -> Option<(&str, &str)> {
        self.baseline.first().map(|(column, value)| (column.as_str(), value.as_str()))
    }
}
