//! Three objects in a row.
use manifactor_graph::prelude::*;
use manifactor_quadric::DualQuadric;

/// The second of three objects is on the line through the other two: r = (c₁ - c₀) × u, u = (c₂ - c₀)/|c₂ -
/// c₀|, in metres.
///
/// The length of r is the distance of the middle centroid from the line. Use the two objects that are
/// furthest apart as the first and the last key. Invariant to moving the second object along the line, and to
/// rotating and scaling any object. Smooth if the outer objects are apart; within a micrometre they do not
/// define a line, and the factor is not defined.
///
/// ```toml
/// [[factors]]
/// keys   = ["chair0", "chair1", "chair2"]
/// factor = { type = "collinear" }
/// noise  = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Collinear {}

/// Distance, in metres, below which two points do not define a line.
const MIN_DISTANCE_M: f64 = 1e-6;

impl Residual for Collinear {
    type Variables = (DualQuadric, DualQuadric, DualQuadric);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (a, b, c): Lifted<Self::Variables, T>) -> Vector3<T> {
        let line = c.centroid() - a.centroid();
        (b.centroid() - a.centroid()).cross(&(line / line.norm_squared().sqrt()))
    }
    fn is_defined(&self, (a, _, c): Refs<'_, Self::Variables>) -> bool {
        (c.centroid() - a.centroid()).norm() > MIN_DISTANCE_M
    }
}
register_factor!("collinear", Collinear);
register_invariance!(Collinear, "moving the second along the line", |_, (a, b, c), random| {
    let mut moved = *b;
    moved.pose.translation += (c.centroid() - a.centroid()) * random(3.0);
    (*a, moved, *c)
});

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::{Se3, So3};
    use manifactor_testing::factor_laws;

    factor_laws! { collinear }

    #[test]
    fn the_error_is_the_distance_from_the_line() {
        let at = |x: f64, y: f64| DualQuadric {
            pose: Se3::new(So3::identity(), Vector3::new(x, y, 0.0)),
            semi_axes: Vector3::repeat(0.1),
        };
        let r = Collinear {}.residual::<f64>((at(0.0, 0.0), at(3.0, 0.25), at(4.0, 0.0)));
        assert!((r.norm() - 0.25).abs() < 1e-12);
        assert!(!Collinear {}.is_defined((&at(1.0, 0.0), &at(0.0, 0.0), &at(1.0, 0.0))));
    }
}
