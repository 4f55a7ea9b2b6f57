use manifactor::prelude::*;
use manifactor::quadric::DualQuadric;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Places an object in the middle of its shelf: r = c · along - middle, in metres.
///
/// c is the object's centroid. Motion orthogonal to `along`, rotation and growth leave r unchanged. Smooth
/// and defined everywhere.
///
/// ```toml
/// [[factors]]
/// keys   = ["q0"]
/// factor = { type = "in_the_middle", along = [1.0, 0.0, 0.0], middle = 0.4 }
/// noise  = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InTheMiddle {
    /// Direction along the shelf, of any length except zero.
    pub along: Direction,
    /// Position of the middle along the shelf. Unit: metres.
    pub middle: f64,
}

impl Residual for InTheMiddle {
    type Variables = (DualQuadric,);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector1<T> {
        let along: Vector3<T> = self.along.lift();
        Vector1::new(quadric.centroid().dot(&along) - self.middle)
    }
}
register_factor!("in_the_middle", InTheMiddle);

#[cfg(test)]
mod tests {
    manifactor::testing::factor_laws! { in_the_middle }
}
