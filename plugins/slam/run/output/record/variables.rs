//! Variables that the document of a run declares, such as the plane of a table.
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::settings::OwnGraph;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// A variable that the document of a run declares, in the map frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OwnVariable {
    /// Key in the graph.
    pub key: String,
    /// Initial value, in the form of documents.
    pub initial: Value,
    /// Estimate, in the form of documents.
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
