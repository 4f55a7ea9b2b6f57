use manifactor::geometry::{Se3, So2};
use manifactor::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A door that hangs in its frame, open by an angle: r = Log((F A Rz(angle))⁻¹ D), (rx, ry, rz, x, y, z).
///
/// F is the frame's pose, D the door's, and A the hinge in the frame, its axis along z. The residual jumps if
/// two rotations are half a turn apart, because there are two shortest paths between them.
///
/// ```toml
/// [[factors]]
/// keys   = ["frame", "opening", "door"]
/// factor = { type = "hinge", axis = { translation = [0.4, 0.0, 0.0], rotation = [0.0, 0.0, 0.0, 1.0] } }
/// noise  = { sigma = 0.01 }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Hinge {
    /// Pose of the hinge in the frame: the door turns about its z axis.
    pub axis: Se3,
}

impl Residual for Hinge {
    type Variables = (Se3, So2, Se3);
    type Dim = U6;

    fn residual<T: Scalar>(&self, (frame, opening, door): Lifted<Self::Variables, T>) -> Vector6<T> {
        let turn = Se3::exp(&(Vector6::z().lift() * opening.angle()));
        (frame * self.axis.lift() * turn).between(&door).log()
    }
}
register_factor!("hinge", Hinge);

#[cfg(test)]
mod tests {
    manifactor::testing::factor_laws! { hinge }
}
