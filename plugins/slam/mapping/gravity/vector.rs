use super::{Gravity, GravityError, MapFrame};
use manifactor_graph::{Direction, register};
use manifactor_recording::sequence::Sequence;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The up direction is a given vector in the odometry frame.
///
/// The odometry of a camera often begins with the identity. Then its frame is the frame of the first camera,
/// with y down, and a camera held level has `up = [0, -1, 0]`.
///
/// ```toml
/// gravity = { type = "vector", up = [0.0, -1.0, 0.0] }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "UpVector")]
pub struct VectorGravity {
    /// Up direction. Any length except zero.
    pub up: Direction,
}

#[typetag::serialize(name = "vector")]
impl Gravity for VectorGravity {
    fn locate(&self, _: &Sequence) -> Result<MapFrame, GravityError> {
        Ok(MapFrame::of_odometry(Some(self.up)))
    }
}
register!(dyn Gravity, "vector", VectorGravity);
