use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `[report]`: what is written besides the usual.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReportSettings {
    /// `covariances.json`: the marginal covariance of each pose and each object, in its tangent space.
    pub covariances: bool,
}
