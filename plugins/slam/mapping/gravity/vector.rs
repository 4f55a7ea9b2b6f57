use super::{Gravity, GravityError, MapFrame};
use manifactor_graph::{Direction, register};
use manifactor_recording::sequence::Sequence;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Up as a vector in the frame of the odometry.
///
/// The odometry of a camera often begins with the identity: then this is the frame of the first camera, in
/// which y points down, and a camera that was held level has `up = [0, -1, 0]`.
///
/// ```toml
/// gravity = { type = "vector", up = [0.0, -1.0, 0.0] }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UpVector {
    /// Up; any length but zero.
    pub up: Direction,
}

#[typetag::serialize(name = "vector")]
impl Gravity for UpVector {
    fn locate(&self, _: &Sequence) -> Result<MapFrame, GravityError> {
        Ok(MapFrame::of_odometry(Some(self.up)))
    }
}
register!(dyn Gravity, "vector", UpVector);
