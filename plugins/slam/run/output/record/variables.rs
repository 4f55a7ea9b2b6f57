//! Variables of the run's own, such as the plane of a table.
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::settings::OwnGraph;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A variable that the run's document has added, in the frame of the map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnVariable {
    /// Its key.
    pub key: String,
    /// Where the solve began, as documents write it.
    pub initial: Value,
    /// Where it ended.
    pub estimate: Value,
}

pub(super) fn variables(own: &OwnGraph, estimate: &Estimate) -> Vec<OwnVariable> {
    let variable = |(key, initial): (&manifactor_graph::Key, &dyn manifactor_graph::Variable)| {
        let estimate = estimate.solution.values.variable(key.as_str())?;
        let json = |value| serde_json::to_value(value).ok();
        Some(OwnVariable { key: key.to_string(), initial: json(initial)?, estimate: json(estimate)? })
    };
    own.values.iter().filter_map(variable).collect()
}
