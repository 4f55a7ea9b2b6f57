use crate::measures::measure_names_in_words;
use indexmap::IndexMap;
use manifactor_graph::checked::Count;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[summary]`: what is averaged, and what is compared with what.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SummarySettings {
    /// Columns whose values are kept apart.
    pub by: Vec<String>,
    /// A column and one of its values: each other value is compared with it, over trials that are alike in all other
    /// columns.
    #[schemars(with = "std::collections::HashMap<String, String>")]
    pub baseline: IndexMap<String, String>,
    /// Trials that are alike in these columns are drawn together; each alone, where none is named.
    pub clusters: Vec<String>,
    /// What is averaged: columns of measures.
    #[schemars(extend("description" = described()))]
    pub metrics: Vec<String>,
    /// A column in `by` whose values stand side by side in `summary.md`: a column of the table for each, metric by metric.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub across: Option<String>,
    /// A column of numbers in `by` that reports draw the metrics over.
    pub curve: Option<String>,
    /// How often trials are drawn anew. At most a million: with that many the ends of an interval are settled to a
    /// thousandth of its width.
    pub resamples: Count<0, 1_000_000>,
    /// Of the random numbers that they are drawn by.
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

/// The description of `metrics`, with all names.
fn described() -> String {
    format!("What is averaged: columns of measures. They are {}.", measure_names_in_words())
}

impl SummarySettings {
    /// The column whose values are compared, and the one they are compared with.
    pub fn compared(&self) -> Option<(&str, &str)> {
        self.baseline.first().map(|(column, value)| (column.as_str(), value.as_str()))
    }
}
