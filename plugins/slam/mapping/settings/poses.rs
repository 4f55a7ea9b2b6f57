use manifactor_graph::Noise;
use manifactor_graph::loss::Loss;
use schemars::JsonSchema;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};
use std::sync::Arc;

/// `[odometry]`: r = Log(Z⁻¹ Xᵢ⁻¹ Xᵢ₊₁), rotation before translation.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OdometrySettings {
    /// Of a relative pose: rad, then m.
    #[serde(deserialize_with = "noise_of::<POSE_ROWS, _>")]
    pub noise: Noise,
    /// How much of a large error counts. Default: all of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<Arc<dyn Loss>>,
}

/// `[prior]`: r = Log(Z⁻¹ X₀).
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PriorSettings {
    /// Of the first pose: rad, then m.
    #[serde(deserialize_with = "noise_of::<POSE_ROWS, _>")]
    pub noise: Noise,
}

/// Rows of a pose's residual: rotation, translation.
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

/// The same σ in each row: a literal that is positive.
pub(super) fn every_row(sigma: f64) -> Noise {
    Noise::sigma(sigma).unwrap_or_default()
}

/// A noise that fits residuals of this many rows: what does not is told once, and not for each factor that gets it.
pub(super) fn noise_of<'de, const ROWS: usize, D: Deserializer<'de>>(from: D) -> Result<Noise, D::Error> {
    let noise = Noise::deserialize(from)?;
    noise.whitener(ROWS).map_err(D::Error::custom)?;
    Ok(noise)
}
