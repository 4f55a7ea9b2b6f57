use manifactor_graph::Noise;
use manifactor_graph::loss::Loss;
use schemars::JsonSchema;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use std::sync::Arc;

/// `[odometry]`: factors r = Log(Z⁻¹ Xᵢ⁻¹ Xᵢ₊₁) between consecutive poses, rotation before translation.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OdometrySettings {
    /// Noise of a relative pose, rotation before translation. Unit: rad, m.
    #[serde(deserialize_with = "noise_of::<POSE_ROWS, _>")]
    pub noise: Noise,
    /// Robust loss. Default: none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<Arc<dyn Loss>>,
}

/// `[prior]`: factor r = Log(Z⁻¹ X₀) on the first pose, rotation before translation.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PriorSettings {
    /// Noise of the first pose, rotation before translation. Unit: rad, m.
    #[serde(deserialize_with = "noise_of::<POSE_ROWS, _>")]
    pub noise: Noise,
}

/// Rows of a pose residual: rotation, translation.
const POSE_ROWS: usize = 6;

impl Default for OdometrySettings {
    fn default() -> Self {
        Self { noise: every_row(0.01), loss: None }
    }
}

impl Default for PriorSettings {
    fn default() -> Self {
        Self { noise: every_row(0.001) }
    }
}

/// Returns noise with equal σ in each row. The literal `sigma` is positive.
pub(super) fn every_row(sigma: f64) -> Noise {
    Noise::sigma(sigma).unwrap_or_default()
}

/// Reads a noise and checks that it fits residuals with this number of rows. The check reports an error once,
/// instead of once per factor.
pub(super) fn noise_of<'de, const ROWS: usize, D: Deserializer<'de>>(from: D) -> Result<Noise, D::Error> {
    let noise = Noise::deserialize(from)?;
    noise.whitener(ROWS).map_err(D::Error::custom)?;
    Ok(noise)
}
