use manifactor_graph::checked::Count;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[report]`: additional output.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReportSettings {
    /// Writes `covariances.json`: the marginal covariance of each pose and each object, in its tangent space.
    pub covariances: bool,
    /// Number of images that are drawn with measured and estimated boxes, spread over all frames that show
    /// objects. At most 1000, because the page of the run contains all of them.
    pub images: Count<0, 1000>,
}

impl Default for ReportSettings {
    fn default() -> Self {
        Self { covariances: false, images: Count::literal(4) }
    }
}
