use super::{MotionError, MotionModel, MotionStep, pose_key};
use manifactor_geometry::{Between, Se3};
use manifactor_graph::{FactorEntry, register};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The relative pose of the odometry connects consecutive frames: r = Log(Z⁻¹ Xᵢ⁻¹ Xᵢ₊₁), with the noise and
/// the loss of `[odometry]`.
///
/// ```toml
/// motion = { type = "odometry" }
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Odometry")]
pub struct OdometryMotion {}

#[typetag::serialize(name = "odometry")]
impl MotionModel for OdometryMotion {
    fn predict(&self, step: &MotionStep<'_>, from: &Se3) -> Se3 {
        from.compose(&step.odometry.pose)
    }

    fn factors(&self, step: &MotionStep<'_>) -> Result<Vec<FactorEntry>, MotionError> {
        let factor = Between { relative: step.odometry.pose };
        Ok(vec![step.entry(step.frames.map(pose_key).to_vec(), Arc::new(factor))])
    }
}
register!(dyn MotionModel, "odometry", OdometryMotion);
