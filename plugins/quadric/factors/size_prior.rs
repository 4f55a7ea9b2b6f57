//! Prior on the size of objects of a class.
use crate::DualQuadric;
use crate::shapes::{AxisOrder, SemiAxes};
use manifactor_graph::prelude::*;

/// An object has the size of its class: r = log(s/s₀), the shortest semi-axis first.
///
/// σ is relative: 0.2 is about 20 %. With `order = "sorted"`, semi-axes are compared by size, so the
/// numbering of the object's axes does not matter. If two semi-axes are equally long, the residual is
/// continuous, but its derivative jumps between the two axes; the first in the current numbering counts as
/// the shorter one. If the two usual lengths are equal as well, the cost has no kink there. With `order =
/// "as_given"`, x is compared with the first usual length, and so on. Defined everywhere.
///
/// Two equal usual lengths, as for a bottle, pull the object towards a shape that is round about its third
/// axis. The rotation about that axis is then undetermined or poorly determined: close to the round shape it
/// behaves like the angle of polar coordinates close to the origin. If only boxes from two places determine
/// the rotation, solvers may take hundreds of steps during which the cost hardly falls. `prior_quadric`, or
/// boxes from more sides, determine this rotation.
/// ```toml
/// [[factors]]
/// keys   = ["q0"]
/// factor = { type = "size_prior", semi_axes = [0.03, 0.04, 0.12] }
/// noise  = { sigma = 0.3 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SizePrior {
    /// Usual semi-axes (half the extents), in metres.
    pub semi_axes: SemiAxes,
    /// Order of the semi-axes in the comparison.
    #[serde(default)]
    pub order: AxisOrder,
}

impl Residual for SizePrior {
    type Variables = (DualQuadric,);
    type Dim = U3;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> Vector3<T> {
        self.order.log_ratio(&quadric.semi_axes, &self.semi_axes)
    }
}
register_factor!("size_prior", SizePrior);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_quadric, tilted, typical_quadric, unequal_quadric};
    use manifactor_graph::Factor;
    use manifactor_testing::{check, invariance_law, jacobian_laws};
    use proptest::prelude::*;

    jacobian_laws! {
        the_jacobian_is_right: (typical_quadric(), unequal_quadric())
            .prop_map(|((semi_axes, order), q)| (SizePrior { semi_axes, order }, q));
    }

    #[test]
    fn the_numbering_of_the_axes_does_not_matter_when_sorted() {
        check((typical_quadric(), any_quadric()), |((semi_axes, _), quadric)| {
            let permuted = Vector3::new(quadric.semi_axes.z, quadric.semi_axes.x, quadric.semi_axes.y);
            let other = DualQuadric { semi_axes: permuted, ..quadric };
            invariance_law(&SizePrior { semi_axes, order: AxisOrder::Sorted }, &[&quadric], &[&other])
        });
    }

    #[test]
    fn a_size_error_of_ten_per_cent_is_a_tenth() {
        let semi_axes = SemiAxes::new(Vector3::new(0.1, 0.2, 0.4)).unwrap();
        let quadric = DualQuadric { semi_axes: Vector3::new(0.44, 0.1, 0.2), ..tilted(0.0) };
        let r = SizePrior { semi_axes, order: AxisOrder::Sorted }.residual::<f64>((quadric,));
        assert!((r - Vector3::new(0.0, 0.0, 1.1f64.ln())).norm() < 1e-12);
    }

    #[test]
    fn equal_semi_axes_have_a_finite_derivative() {
        let semi_axes = SemiAxes::new(Vector3::new(0.1, 0.2, 0.4)).unwrap();
        let round = DualQuadric { semi_axes: Vector3::repeat(0.2), ..tilted(0.3) };
        let prior = SizePrior { semi_axes, order: AxisOrder::Sorted };
        let l = Factor::erased(&prior).linearize(&[&round]).unwrap();
        assert_eq!(l.jacobians[0].columns(6, 3).into_owned(), nalgebra::Matrix3::identity());
    }

    #[test]
    fn lengths_are_checked() {
        let read = |text: &str| serde_json::from_str::<SizePrior>(text).map_err(|e| e.to_string());
        assert!(read(r#"{"semi_axes": [0.1, 0.2, 0.3], "order": "as_given"}"#).is_ok());
        assert!(read(r#"{"semi_axes": [0.1, -0.2, 0.3]}"#).unwrap_err().contains("from 1e-9 to 1e9"));
        assert!(read(r#"{"semi_axes": [0.1, 0.2, 0.3], "order": "any"}"#).is_err());
    }
}
