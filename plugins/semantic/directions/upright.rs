//! A named axis of an object is vertical.
use crate::{Axis, S2};
use manifactor_graph::prelude::*;
use manifactor_quadric::DualQuadric;

/// A named axis of an object is vertical: r = a × up, of length sin(tilt).
///
/// Like `vertical_orientation_smooth`, but for any axis: a plate lies flat with `axis = "shortest"`, an
/// object with known local axes stands with `axis = "z"`. Upside down counts as upright. σ is in radians of
/// tilt. Invariant to rotating about `up`, moving and scaling. `longest` and `shortest` jump if a different
/// axis becomes the longest or the shortest. A horizontal axis is a maximum, at which the derivative of the
/// cost vanishes. Defined everywhere.
///
/// ```toml
/// [[factors]]
/// keys   = ["plate"]
/// factor = { type = "upright", axis = "shortest" }
/// noise  = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Upright {
    /// The axis: longest, shortest, x, y or z. Default: longest.
    #[serde(default)]
    pub axis: Axis,
    /// The world's up direction, of any length but zero. Default: z.
    #[serde(default)]
    pub up: Up,
}

impl Residual for Upright {
    type Variables = (DualQuadric,);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector3<T> {
        self.axis.direction(&quadric).cross(&self.up.lift())
    }
}
register_factor!("upright", Upright, up);
register_invariance!(Upright, "moving, growing, and turning about its axis", |factor, (quadric,), random| {
    let turn = manifactor_geometry::So3::exp(&(factor.axis.direction(quadric) * random(3.0)));
    let mut moved = *quadric;
    moved.pose.rotation = turn.compose(&quadric.pose.rotation);
    moved.pose.translation += Vector3::new(random(5.0), random(5.0), random(5.0));
    moved.semi_axes *= random(2.0).exp();
    (moved,)
});

/// A named axis of an object is vertical, with the up direction as a variable: r = a × g, of length
/// sin(angle).
///
/// Variables: the object, and the direction g, for example of gravity. Upright objects then also determine
/// the up direction. All else is as in `upright`.
///
/// ```toml
/// [[factors]]
/// keys   = ["bottle", "g"]
/// factor = { type = "upright_along", axis = "longest" }
/// noise  = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UprightAlong {
    /// The axis: longest, shortest, x, y or z. Default: longest.
    #[serde(default)]
    pub axis: Axis,
}

impl Residual for UprightAlong {
    type Variables = (DualQuadric, S2);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (quadric, up): Lifted<Self::Variables, T>) -> Vector3<T> {
        self.axis.direction(&quadric).cross(&up)
    }
}
register_factor!("upright_along", UprightAlong);

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_quadric::VerticalOrientationSmooth;
    use manifactor_quadric::testing::tilted;
    use manifactor_testing::factor_laws;

    factor_laws! { upright, upright_along }

    #[test]
    fn the_longest_axis_is_the_vertical_orientation() {
        let quadric = tilted(0.3);
        let known = VerticalOrientationSmooth::default().residual::<f64>((quadric,));
        assert_eq!(Upright::default().residual::<f64>((quadric,)), known);
        let along = UprightAlong::default().residual::<f64>((quadric, Vector3::z()));
        assert_eq!(along, known);
    }

    #[test]
    fn another_axis_is_as_far_from_up_as_it_is() {
        let r = Upright { axis: Axis::Y, ..Upright::default() }.residual::<f64>((tilted(0.3),));
        assert!((r.norm() - 0.3f64.cos()).abs() < 1e-12);
    }
}
