//! A relative measurement between two variables, such as odometry or a loop closure: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).
//!
//! The logarithm jumps if measurement and estimate differ by a rotation of π.
use crate::groups::LieGroup;
use crate::{Point1, Point2, Point3, Se2, Se3, Sim3, So2, So3};
use manifactor_graph::prelude::*;

/// A measurement of the second variable in the frame of the first: `relative`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(bound = "G: LieGroup + JsonSchema", description = description::<G>())]
pub struct Between<G> {
    /// The second variable in the frame of the first.
    pub relative: G,
}

fn description<G: LieGroup>() -> String {
    format!(
        "The second variable is at `relative`, seen from the first: r = Log(Z⁻¹ Xᵢ⁻¹ Xⱼ).\n\nOne row for \
         each tangent direction ({}). Two rotations that are half a turn apart have two shortest ways \
         between them: there the residual jumps.\n\n```toml\n[[factors]]\nkeys = [\"x0\", \"x1\"]\n\
         factor = {{ type = \"between_{}\", relative = {} }}\nnoise = {{ sigma = 0.1 }}\n```",
        G::TANGENT.join(", "),
        G::NAME,
        G::EXAMPLE
    )
}

impl<G: LieGroup> Residual for Between<G> {
    type Variables = (G, G);
    type Dim = G::Dim;
    const ROWS: &'static [&'static str] = G::TANGENT;

    #[inline]
    fn residual<T: Scalar>(&self, (a, b): Lifted<Self::Variables, T>) -> Vector<G::Dim, T> {
        G::log(&G::between(&self.relative.lift(), &G::between(&a, &b)))
    }
    fn linearize(
        &self,
        (a, b): Refs<'_, Self::Variables>,
        free: &[bool],
        jacobians: &mut Jacobians<Self>,
    ) -> Tangent<G> {
        let b_in_a = G::between(&a.lift::<f64>(), &b.lift());
        let r = G::log(&G::between(&self.relative.lift(), &b_in_a));
        // Log(Z⁻¹ (A Exp δ)⁻¹ B) = Log(Z⁻¹ A⁻¹B · Exp(-Ad((A⁻¹B)⁻¹) δ))
        jacobians.1 = G::inverse_right_jacobian(&r);
        if free[0] {
            jacobians.0 = G::minus_product(&jacobians.1, &G::adjoint_of_inverse(&b_in_a));
        }
        r
    }
}

register_factor!("between_so2", Between<So2>);
register_factor!("between_so3", Between<So3>);
register_factor!("between_se2", Between<Se2>);
register_factor!("between_se3", Between<Se3>);
register_factor!("between_sim3", Between<Sim3>);
register_factor!("between_point1", Between<Point1>);
register_factor!("between_point2", Between<Point2>);
register_factor!("between_point3", Between<Point3>);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rn;
    use crate::testing::*;
    use manifactor_graph::Manifold;
    use manifactor_testing::{check, invariance_law, jacobian_laws, strategies::rotation_vector};
    use nalgebra::{Vector3, Vector6};
    use proptest::prelude::*;

    // The second variable is drawn by its difference from the measurement, as the singular points depend on
    // that difference.
    macro_rules! cases {
        ($any:expr, $tangent:expr) => {
            ($any, $any, $tangent)
                .prop_map(|(x, relative, d)| (Between { relative }, x, x.compose(&relative).retract(&d)))
        };
    }
    jacobian_laws! {
        jacobians_agree_on_so2: cases!(any_so2(), so2_tangent());
        jacobians_agree_on_so3: cases!(any_so3(), rotation_vector());
        jacobians_agree_on_se2: cases!(any_se2(), se2_tangent());
        jacobians_agree_on_se3: cases!(any_se3(), se3_tangent());
        jacobians_agree_on_sim3: cases!(any_sim3(), sim3_tangent());
        jacobians_agree_on_point1: shifted::<1>();
        jacobians_agree_on_point2: shifted::<2>();
        jacobians_agree_on_point3: shifted::<3>();
    }

    fn shifted<const N: usize>() -> impl Strategy<Value = (Between<Rn<N>>, Rn<N>, Rn<N>)> {
        (any_point(), any_point(), any_point()).prop_map(|(relative, x, y)| (Between { relative }, x, y))
    }

    #[test]
    fn moving_both_poses_changes_nothing() {
        check((any_se3(), any_se3(), any_se3(), any_se3()), |(relative, x, y, m)| {
            // Away from the jump at half a turn, as rounding alone would change the residual there.
            let y = if relative.local(&x.between(&y)).fixed_rows::<3>(0).norm() > 3.1 { x } else { y };
            invariance_law(&Between { relative }, &[&x, &y], &[&m.compose(&x), &m.compose(&y)])
        });
    }

    #[test]
    fn a_step_forward_that_was_a_turn_is_off_by_both() {
        let relative = Se2::exp(&Vector3::new(0.0, 0.0, 0.5));
        let y = Se2::exp(&Vector3::new(0.0, 0.0, 0.5)).compose(&Se2::exp(&Vector3::new(1.0, 0.0, 0.0)));
        let r = Between { relative }.residual::<f64>((Se2::identity(), y));
        assert!((r - Vector3::new(1.0, 0.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn half_a_turn_off_is_finite() {
        let relative = Se3::exp(&Vector6::new(std::f64::consts::PI, 0.0, 0.0, 1.0, 2.0, 3.0));
        let (x, between) = (Se3::identity(), Between { relative });
        let mut jacobians = (nalgebra::Matrix6::zeros(), nalgebra::Matrix6::zeros());
        let r = between.linearize((&x, &x), &[true, true], &mut jacobians);
        assert!((r.fixed_rows::<3>(0).norm() - std::f64::consts::PI).abs() < 1e-12);
        assert!(jacobians.0.iter().chain(&jacobians.1).all(|x| x.is_finite()));
    }
}
