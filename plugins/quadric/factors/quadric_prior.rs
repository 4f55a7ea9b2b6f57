//! Prior on the pose and size of an object.
use crate::DualQuadric;
use manifactor_graph::prelude::*;
use nalgebra::{SMatrix, SVector};

/// A prior: the object is close to `value`: r = (Log(Z⁻¹X), log(s/s₀)), pose first.
///
/// Rows: rotation in radians and translation in metres, both in the prior's frame, then the logarithms of the
/// semi-axes, axis by axis: 0.1 is 10 % of size. To constrain only the pose or only the size, mask the
/// remaining rows with `observed`. Two rotations half a turn apart have two shortest paths between them, so
/// the residual jumps there, although half a turn about an axis leaves the ellipsoid unchanged.
///
/// ```toml
/// [[factors]]
/// keys   = ["q0"]
/// factor = { type = "prior_quadric", value = { translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8], semi_axes = [0.1, 0.2, 0.3] } }
/// noise  = { sigmas = [0.2, 0.2, 0.2, 0.5, 0.5, 0.5, 0.3, 0.3, 0.3] }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuadricPrior {
    /// Expected pose and semi-axes of the object.
    pub value: DualQuadric,
}

impl Residual for QuadricPrior {
    type Variables = (DualQuadric,);
    type Dim = U9;
    const ROWS: &'static [&'static str] = DualQuadric::TANGENT;

    fn residual<T: Scalar>(&self, (quadric,): Lifted<Self::Variables, T>) -> SVector<T, 9> {
        let xi = self.value.pose.lift::<T>().between(&quadric.pose).log();
        let ratio = quadric.semi_axes.component_div(&self.value.semi_axes.lift());
        SVector::from_fn(|i, _| if i < 6 { xi[i] } else { ratio[i - 6].ln() })
    }

    fn linearize(
        &self,
        (quadric,): Refs<'_, Self::Variables>,
        _free: &[bool],
        jacobians: &mut Jacobians<Self>,
    ) -> SVector<f64, 9> {
        let r = self.value.local(quadric);
        let pose = manifactor_geometry::Se3::inverse_right_jacobian(&r.fixed_rows::<6>(0).into_owned());
        jacobians.0 = SMatrix::identity();
        jacobians.0.fixed_view_mut::<6, 6>(0, 0).copy_from(&pose);
        r
    }
}
register_factor!("prior_quadric", QuadricPrior);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_quadric, quadric_tangent};
    use manifactor_testing::jacobian_laws;
    use proptest::prelude::*;

    jacobian_laws! {
        the_jacobian_is_right: (any_quadric(), quadric_tangent())
            .prop_map(|(value, d)| (QuadricPrior { value }, value.retract(&d)))
    }

    proptest! {
        #[test]
        fn the_residual_is_the_way_from_the_prior(value in any_quadric(), delta in quadric_tangent()) {
            let r = QuadricPrior { value }.residual::<f64>((value.retract(&delta),));
            prop_assert!((r - delta).norm() < 1e-9);
        }
    }

    #[test]
    fn a_document_reads_back() {
        let text = r#"{"value":{"translation":[1.0,0.0,0.5],"rotation":[0.0,0.0,0.6,0.8],"semi_axes":[0.1,0.2,0.3]}}"#;
        let prior = serde_json::from_str::<QuadricPrior>(text).unwrap();
        assert_eq!(serde_json::to_string(&prior).unwrap(), text);
    }
}
