//! Prior on a variable: r = Log(Z⁻¹X).
//!
//! The logarithm jumps if X differs from Z by a rotation of π.
use crate::groups::LieGroup;
use crate::{ImuBias, Point1, Point2, Point3, Se2, Se3, Sim3, So2, So3, Twist, Velocity};
use manifactor_graph::prelude::*;

/// A prior: the variable is close to `value`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(bound = "G: LieGroup + JsonSchema", description = description::<G>())]
pub struct Prior<G> {
    /// Expected value of the variable.
    pub value: G,
}

fn description<G: LieGroup>() -> String {
    format!(
        "The variable is close to `value`: r = Log(Z⁻¹X).\n\nOne row for each tangent direction ({}). \
         Two rotations that are half a turn apart have two shortest ways between them: there the \
         residual jumps.\n\n```toml\n[[factors]]\nkeys = [\"x0\"]\nfactor = {{ type = \"prior_{}\", \
         value = {} }}\nnoise = {{ sigma = 0.1 }}\n```",
        G::TANGENT.join(", "),
        G::NAME,
        G::EXAMPLE
    )
}

impl<G: LieGroup> Residual for Prior<G> {
    type Variables = (G,);
    type Dim = G::Dim;
    const ROWS: &'static [&'static str] = G::TANGENT;

    #[inline]
    fn residual<T: Scalar>(&self, (x,): Lifted<Self::Variables, T>) -> Vector<G::Dim, T> {
        G::log(&G::between(&self.value.lift(), &x))
    }
    fn linearize(
        &self,
        (x,): Refs<'_, Self::Variables>,
        _free: &[bool],
        jacobians: &mut Jacobians<Self>,
    ) -> Tangent<G> {
        let r = self.residual((x.lift(),));
        jacobians.0 = G::inverse_right_jacobian(&r);
        r
    }
}

register_factor!("prior_so2", Prior<So2>);
register_factor!("prior_so3", Prior<So3>);
register_factor!("prior_se2", Prior<Se2>);
register_factor!("prior_se3", Prior<Se3>);
register_factor!("prior_sim3", Prior<Sim3>);
register_factor!("prior_point1", Prior<Point1>);
register_factor!("prior_point2", Prior<Point2>);
register_factor!("prior_point3", Prior<Point3>);
register_factor!("prior_twist", Prior<Twist>);
register_factor!("prior_velocity", Prior<Velocity>);
register_factor!("prior_imu_bias", Prior<ImuBias>);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{
        any_imu_bias, any_point, any_se2, any_se3, any_sim3, any_so2, any_so3, any_twist, any_velocity,
        se2_tangent, se3_tangent, sim3_tangent,
    };
    use manifactor_graph::Manifold;
    use manifactor_testing::{jacobian_laws, strategies::rotation_vector};
    use proptest::prelude::*;

    // The variable is drawn by its difference from the prior, as the singular points depend on that
    // difference.
    jacobian_laws! {
        jacobians_agree_on_so2: (any_so2(), any_so2()).prop_map(|(value, x)| (Prior { value }, x));
        jacobians_agree_on_so3: (any_so3(), rotation_vector()).prop_map(|(value, d)| (Prior { value }, value.retract(&d)));
        jacobians_agree_on_se2: (any_se2(), se2_tangent()).prop_map(|(value, d)| (Prior { value }, value.retract(&d)));
        jacobians_agree_on_se3: (any_se3(), se3_tangent()).prop_map(|(value, d)| (Prior { value }, value.retract(&d)));
        jacobians_agree_on_sim3: (any_sim3(), sim3_tangent()).prop_map(|(value, d)| (Prior { value }, value.retract(&d)));
        jacobians_agree_on_point1: (any_point::<1>(), any_point::<1>()).prop_map(|(value, x)| (Prior { value }, x));
        jacobians_agree_on_point2: (any_point::<2>(), any_point::<2>()).prop_map(|(value, x)| (Prior { value }, x));
        jacobians_agree_on_point3: (any_point::<3>(), any_point::<3>()).prop_map(|(value, x)| (Prior { value }, x));
        jacobians_agree_on_twist: (any_twist(), any_twist()).prop_map(|(value, x)| (Prior { value }, x));
        jacobians_agree_on_velocity: (any_velocity(), any_velocity()).prop_map(|(value, x)| (Prior { value }, x));
        jacobians_agree_on_imu_bias: (any_imu_bias(), any_imu_bias()).prop_map(|(value, x)| (Prior { value }, x));
    }

    proptest! {
        #[test]
        fn the_residual_is_the_way_from_the_prior(value in any_se3(), delta in se3_tangent()) {
            let r = Prior { value }.residual::<f64>((value.retract(&delta),));
            prop_assert!((r - delta).norm() < 1e-9);
        }
    }

    #[test]
    fn a_document_reads_back() {
        let prior = Prior { value: Se2::exp(&nalgebra::Vector3::new(0.1, 0.2, 0.3)) };
        let text = serde_json::to_string(&prior).unwrap();
        assert_eq!(serde_json::from_str::<Prior<Se2>>(&text).unwrap(), prior);
        assert!(serde_json::from_str::<Prior<Se2>>("{}").unwrap_err().to_string().contains("value"));
    }
}
