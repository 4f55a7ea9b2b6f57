//! An object rests on a horizontal plane.
use manifactor::prelude::*;
use manifactor::quadric::DualQuadric;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The lowest point of an object is on a horizontal plane: r = c · up - e - height.
///
/// c is its centroid, e half its extent along `up`: e² = Σ (sₖ Rₖ · up)² over the semi-axes s along the
/// columns R. Sliding along the plane and turning about `up` leave it unchanged. It is defined everywhere,
/// and smooth, as semi-axes are never zero.
///
/// ```toml
/// [[factors]]
/// keys   = ["q0"]
/// factor = { type = "rests_on", height = 0.7 }
/// noise  = { sigma = 0.01 }
/// ```
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RestsOn {
    /// The plane's height along `up`, in metres.
    pub(crate) height: f64,
    /// The world's up, of any length but zero. Default: z.
    #[serde(default)]
    pub(crate) up: Up,
}

impl Residual for RestsOn {
    type Variables = (DualQuadric,);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector1<T> {
        let up = self.up.lift();
        let up_in_object = quadric.pose.rotation.inverse().act(&up);
        let e = up_in_object.component_mul(&quadric.semi_axes).norm_squared().sqrt();
        Vector1::new(quadric.centroid().dot(&up) - e - self.height)
    }
}
register_factor!("rests_on", RestsOn, up);
