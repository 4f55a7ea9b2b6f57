use manifactor_graph::checked::Count;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[report]`: what is written besides the usual.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReportSettings {
    /// `covariances.json`: the marginal covariance of each pose and each object, in its tangent space.
    pub covariances: bool,
    /// How many images are drawn with their boxes, measured and estimated; spread over all frames where objects are seen.
    /// At most 1000: the page of the run holds all of them.
    pub images: Count<0, 1000>,
}

impl Default for ReportSettings {
    fn default() -> Self {
        Self { covariances: false, images: Count::literal(4) }
    }
}
