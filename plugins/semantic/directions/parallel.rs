//! Two objects with parallel axes.
use crate::Axis;
use manifactor_graph::prelude::*;
use manifactor_quadric::DualQuadric;

/// An axis of an object is parallel to an axis of another: r = a₀ × a₁, of length sin(angle).
///
/// The signs of the axes do not matter. σ is in radians, close to alignment. Invariant to moving either
/// object, to rotating both together, and to rotating either about its axis. Smooth, except that `longest`
/// and `shortest` jump if a different axis becomes the longest or the shortest. Perpendicular axes are a
/// maximum, at which the derivative of the cost vanishes. Defined everywhere.
///
/// ```toml
/// [[factors]]
/// keys   = ["book0", "book1"]
/// factor = { type = "parallel", axes = ["longest", "longest"] }
/// noise  = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parallel {
    /// The axis of each object: longest, shortest, x, y or z. Default: the longest of both.
    #[serde(default)]
    pub axes: [Axis; 2],
}

impl Residual for Parallel {
    type Variables = (DualQuadric, DualQuadric);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector3<T> {
        self.axes[0].direction(&a).cross(&self.axes[1].direction(&b))
    }
}
register_factor!("parallel", Parallel);
register_invariance!(
    Parallel,
    "turning an object about its axis, and moving it",
    |factor, (a, b), random| {
        let mut moved = *b;
        let turn = manifactor_geometry::So3::exp(&(factor.axes[1].direction(b) * random(3.0)));
        moved.pose.rotation = turn.compose(&b.pose.rotation);
        moved.pose.translation += Vector3::new(random(5.0), random(5.0), random(5.0));
        (*a, moved)
    }
);

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_quadric::testing::tilted;
    use manifactor_testing::factor_laws;

    factor_laws! { parallel }

    #[test]
    fn the_error_is_the_sine_of_the_angle() {
        let r = Parallel::default().residual::<f64>((tilted(0.1), tilted(0.5)));
        assert!((r.norm() - 0.4f64.sin()).abs() < 1e-12);
        let other = Parallel { axes: [Axis::Longest, Axis::Shortest] };
        assert!((other.residual::<f64>((tilted(0.0), tilted(0.0))).norm() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn an_axis_that_is_none_is_refused_with_those_that_are() {
        let error =
            serde_json::from_str::<Parallel>(r#"{"axes": ["longest", "w"]}"#).unwrap_err().to_string();
        assert!(error.contains("`longest`, `shortest`, `x`, `y`, `z`"), "{error}");
    }
}
