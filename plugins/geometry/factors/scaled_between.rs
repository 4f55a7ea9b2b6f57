//! A relative pose whose translation is known up to a scale, as a camera without depth measures it.
use crate::{Point1, Se3};
use manifactor_graph::prelude::*;

/// A relative pose in the unit of the odometry: r = Log(Z⁻¹ S⁻¹(Xᵢ⁻¹ Xⱼ)), where S⁻¹ divides the translation by
/// the scale.
///
/// The third variable is the logarithm of the scale, in metres per unit of the odometry. Steps with the same
/// variable have the same scale. Rows: rotation in rad, then translation in units of the odometry. If poses,
/// objects and scale grow together, the residual does not change: something else, such as the size of an
/// object, has to determine the scale.
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "x1", "s0"]
/// factor = { type = "scaled_between_se3", relative = { translation = [1.0, 0.0, 0.5], rotation = [0.0, 0.0, 0.6, 0.8] } }
/// noise = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScaledBetween {
    /// The second pose in the frame of the first, in the unit of the odometry.
    pub relative: Se3,
}

impl Residual for ScaledBetween {
    type Variables = (Se3, Se3, Point1);
    type Dim = U6;
    const ROWS: &'static [&'static str] = <Se3 as Manifold>::TANGENT;

    fn residual<T: Scalar>(&self, (a, b, log_scale): Lifted<Self::Variables, T>) -> Vector<U6, T> {
        let mut step = a.between(&b);
        step.translation *= (-log_scale.x).exp();
        self.relative.lift::<T>().between(&step).log()
    }
}
register_factor!("scaled_between_se3", ScaledBetween);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::So3;
    use crate::testing::{any_se3, se3_tangent};
    use manifactor_testing::{check, invariance_law, jacobian_laws};
    use nalgebra::Vector1;
    use proptest::prelude::*;

    /// The second pose is drawn by its difference from the measurement, on which the singular points depend.
    fn cases() -> impl Strategy<Value = (ScaledBetween, Se3, Se3, Point1)> + Clone {
        (any_se3(), any_se3(), se3_tangent(), -2.0..2.0f64).prop_map(|(relative, x, d, log_scale)| {
            let mut step = relative.retract(&d);
            step.translation *= log_scale.exp();
            (ScaledBetween { relative }, x, x.compose(&step), Point1::new(Vector1::new(log_scale)))
        })
    }
    jacobian_laws! { jacobians_agree: cases() }

    #[test]
    fn a_world_of_another_size_has_the_same_residual() {
        check((cases(), -1.0..1.0f64), |((factor, x, y, scale), growth)| {
            let larger = |pose: &Se3| Se3::new(pose.rotation, pose.translation * growth.exp());
            // away from the jump at half a turn, where rounding alone changes the residual
            let r = factor.residual::<f64>((x, y, scale.0));
            let y = if r.fixed_rows::<3>(0).norm() > 3.1 { x } else { y };
            let grown = Point1::new(scale.0 + Vector1::new(growth));
            invariance_law(&factor, &[&x, &y, &scale], &[&larger(&x), &larger(&y), &grown])
        });
    }

    #[test]
    fn a_step_of_two_metres_that_was_measured_as_one_has_the_scale_two() {
        let step = |length: f64| Se3::new(So3::identity(), nalgebra::Vector3::new(length, 0.0, 0.0));
        let residual = |log_scale: f64| {
            let factor = ScaledBetween { relative: step(1.0) };
            factor.residual::<f64>((Se3::identity(), step(2.0), Vector1::new(log_scale)))
        };
        assert!(residual(2f64.ln()).norm() < 1e-15);
        assert!((residual(0.0).norm() - 1.0).abs() < 1e-15);
    }
}
