//! An object on top of another.
use crate::directions::axis::extent;
use manifactor_graph::prelude::*;
use manifactor_quadric::DualQuadric;

/// The lowest point of an object is as high as the highest point of another: r = (c₁ - c₀) · up - e₁ - e₀, in
/// metres.
///
/// Variables: the object on top (1), and the object that carries it (0). eᵢ is half the extent along `up`, as
/// in `supporting_plane`. The two need not be above each other; a box or a prior has to constrain that.
/// Invariant to moving either object sideways and to rotating it about `up`. The top of an ellipsoid is a
/// point, so the model fits an object with a flat top only if the ellipsoid is as high as the object. Smooth
/// and defined everywhere.
///
/// ```toml
/// [[factors]]
/// keys   = ["cup", "book"]
/// factor = { type = "on_object" }
/// noise  = { sigma = 0.02 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OnObject {
    /// The world's up direction, of any length but zero. Default: z.
    #[serde(default)]
    pub up: Up,
}

impl Residual for OnObject {
    type Variables = (DualQuadric, DualQuadric);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (top, below): Lifted<Self::Variables, T>) -> Vector1<T> {
        let up: Vector3<T> = self.up.lift();
        let rise = (top.centroid() - below.centroid()).dot(&up);
        Vector1::new(rise - extent(&top, &up) - extent(&below, &up))
    }
}
register_factor!("on_object", OnObject, up);
register_invariance!(
    OnObject,
    "moving the object on top sideways, and turning it about up",
    |factor, (top, below), random| {
        let mut moved = *top;
        moved.pose.translation += factor.up.cross(&Vector3::new(random(5.0), random(5.0), random(5.0)));
        let turn = manifactor_geometry::So3::exp(&factor.up.scale(random(3.0)));
        moved.pose.rotation = turn.compose(&moved.pose.rotation);
        (moved, *below)
    }
);

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::{Se3, So3};
    use manifactor_testing::factor_laws;

    factor_laws! { on_object }

    #[test]
    fn the_error_is_the_gap_between_the_two() {
        let at = |z: f64| DualQuadric {
            pose: Se3::new(So3::identity(), Vector3::new(z, 0.0, z)),
            semi_axes: Vector3::new(0.4, 0.4, 0.1),
        };
        assert!((OnObject::default().residual::<f64>((at(1.25), at(1.0))).x - 0.05).abs() < 1e-12);
    }
}
