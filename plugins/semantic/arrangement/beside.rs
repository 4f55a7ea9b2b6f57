//! Two objects side by side.
use crate::directions::axis::extent;
use manifactor_graph::prelude::*;
use manifactor_quadric::DualQuadric;

/// Two objects stand side by side with a given gap: r = |h| - e₀ - e₁ - gap, in metres.
///
/// h is the vector between the two centroids without its component along `up`; u = h/|h|, and eᵢ is half the
/// extent of object i along u. Invariant to moving either object along `up`, to swapping the objects, and to
/// moving one around the other without rotation relative to h. If the centroids coincide when seen from
/// above, within a micrometre, there is no direction between them and the factor is not defined.
///
/// ```toml
/// [[factors]]
/// keys   = ["monitor", "keyboard"]
/// factor = { type = "beside", gap = 0.05 }
/// noise  = { sigma = 0.05 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Beside {
    /// Gap between the objects, in metres. Default: 0, the objects touch.
    #[serde(default)]
    pub gap: f64,
    /// The world's up direction, of any length but zero. Default: z.
    #[serde(default)]
    pub up: Up,
}

/// Distance, in metres, below which the direction between two objects is undefined.
const MIN_DISTANCE_M: f64 = 1e-6;

impl Beside {
    fn across<T: Scalar>(&self, a: &DualQuadric<T>, b: &DualQuadric<T>) -> Vector3<T> {
        let (up, way): (Vector3<T>, _) = (self.up.lift(), b.centroid() - a.centroid());
        way - up * way.dot(&up)
    }
}

impl Residual for Beside {
    type Variables = (DualQuadric, DualQuadric);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector1<T> {
        let h = self.across(&a, &b);
        let length = h.norm_squared().sqrt();
        let u = h / length;
        Vector1::new(length - extent(&a, &u) - extent(&b, &u) - T::from(self.gap))
    }
    fn is_defined(&self, (a, b): Refs<'_, Self::Variables>) -> bool {
        self.across(a, b).norm() > MIN_DISTANCE_M
    }
}
register_factor!("beside", Beside, up);
register_invariance!(Beside, "moving along up, and changing places", |factor, (a, b), random| {
    let (mut a, mut b) = (*a, *b);
    a.pose.translation += factor.up.scale(random(5.0));
    b.pose.translation += factor.up.scale(random(5.0));
    (b, a)
});

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::{Se3, So3};
    use manifactor_testing::factor_laws;

    factor_laws! { beside }

    #[test]
    fn the_error_is_the_gap_less_what_was_asked_for() {
        let at = |x: f64| DualQuadric {
            pose: Se3::new(So3::identity(), Vector3::new(x, 0.0, x)),
            semi_axes: Vector3::new(0.3, 0.1, 0.1),
        };
        let factor = Beside { gap: 0.2, ..Beside::default() };
        assert!((factor.residual::<f64>((at(0.0), at(1.0))).x - 0.2).abs() < 1e-12);
        assert!(!factor.is_defined((&at(1.0), &at(1.0))));
    }
}
