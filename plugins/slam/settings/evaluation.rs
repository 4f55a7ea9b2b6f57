use crate::metrics::Alignment;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[evaluation]`: how a trajectory is compared with the truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EvaluationSettings {
    /// Ways to bring the estimate into the frame of the truth, each reported; the first in tables.
    pub alignments: Vec<Alignment>,
    /// How far apart in time a pose and its truth may be, in seconds.
    pub max_time_difference: f64,
    /// Over how many frames relative errors are taken.
    pub relative_over: usize,
}

impl Default for EvaluationSettings {
    fn default() -> Self {
        Self { alignments: vec![Alignment::Se3], max_time_difference: 0.02, relative_over: 1 }
    }
}
