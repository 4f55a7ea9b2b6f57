//! Motion of a body with constant velocity and white noise on the acceleration.
use crate::groups::LieGroup;
use crate::{Se3, Twist};
use manifactor_graph::Noise;
use manifactor_graph::checked::Positive;
use manifactor_graph::noise::NoiseError;
use manifactor_graph::prelude::*;
use nalgebra::{DMatrix, SVector, U12};

/// A body moves between two poses with constant velocity: r = (Log(Xᵢ⁻¹ Xⱼ) − vᵢ Δt, vⱼ − vᵢ).
///
/// Velocities are in the frame of the body. For white noise on the acceleration, the covariance grows with
/// Δt; see Anderson and Barfoot, *Full STEAM Ahead*, 2015. Rows: the residual of the pose (rad, m), then of
/// the velocity (rad/s, m/s).
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "v0", "x1", "v1"]
/// factor = { type = "constant_velocity", seconds = 0.1 }
/// noise = { sigma = 0.1 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstantVelocity {
    /// Time from the first pose to the second, in seconds.
    pub seconds: Positive,
}

impl ConstantVelocity {
    /// Returns the noise model of this factor for white noise on the acceleration.
    ///
    /// The spectral densities are `angular` (rad/s²/√Hz) and `linear` (m/s²/√Hz).
    ///
    /// # Errors
    /// If the covariance cannot be inverted, because the time step is too short or too long.
    pub fn noise(&self, angular: Positive, linear: Positive) -> Result<Noise, NoiseError> {
        let dt = self.seconds.get();
        let mut covariance = DMatrix::zeros(12, 12);
        for i in 0..6 {
            let density = if i < 3 { angular.get().powi(2) } else { linear.get().powi(2) };
            covariance[(i, i)] = density * dt.powi(3) / 3.0;
            covariance[(i, i + 6)] = density * dt.powi(2) / 2.0;
            covariance[(i + 6, i)] = density * dt.powi(2) / 2.0;
            covariance[(i + 6, i + 6)] = density * dt;
        }
        Noise::covariance(covariance)
    }
}

impl Residual for ConstantVelocity {
    type Variables = (Se3, Twist, Se3, Twist);
    type Dim = U12;
    const ROWS: &'static [&'static str] = &[
        "rotation_x",
        "rotation_y",
        "rotation_z",
        "translation_x",
        "translation_y",
        "translation_z",
        "wx",
        "wy",
        "wz",
        "vx",
        "vy",
        "vz",
    ];

    fn residual<T: Scalar>(&self, (a, va, b, vb): Lifted<Self::Variables, T>) -> SVector<T, 12> {
        let moved = <Se3 as LieGroup>::log(&<Se3 as LieGroup>::between(&a, &b));
        let dt = self.seconds.get();
        let mut r = SVector::zeros();
        for i in 0..6 {
            r[i] = moved[i] - va[i] * dt;
            r[i + 6] = vb[i] - va[i];
        }
        r
    }
}

register_factor!("constant_velocity", ConstantVelocity);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se3, any_twist, se3_tangent};
    use manifactor_testing::jacobian_laws;
    use nalgebra::Vector6;
    use proptest::prelude::*;

    fn any_factor() -> impl Strategy<Value = ConstantVelocity> {
        (0.01..10.0_f64).prop_map(|seconds| ConstantVelocity { seconds: Positive::new(seconds).unwrap() })
    }

    jacobian_laws! {
        jacobians_agree: (any_factor(), any_se3(), any_twist(), se3_tangent(), any_twist())
            .prop_map(|(factor, x, v, d, w)| (factor, x, v, x.retract(&d), w));
    }

    #[test]
    fn a_screw_at_constant_velocity_costs_nothing() {
        let twist = Twist(Vector6::new(0.1, -0.2, 0.3, 1.0, 0.5, -0.2));
        let factor = ConstantVelocity { seconds: Positive::new(0.5).unwrap() };
        let start = Se3::exp(&Vector6::new(0.3, 0.2, 0.1, 4.0, 5.0, 6.0));
        let end = start.retract(&(twist.0 * 0.5));
        assert!(factor.residual::<f64>((start, twist.0, end, twist.0)).norm() < 1e-12);
    }

    #[test]
    fn two_short_steps_are_as_uncertain_as_a_long_one() {
        let noise = |seconds: f64| {
            let factor = ConstantVelocity { seconds: Positive::new(seconds).unwrap() };
            let noise = factor.noise(Positive::new(2.0).unwrap(), Positive::new(3.0).unwrap()).unwrap();
            noise.information_matrix(12).unwrap().try_inverse().unwrap()
        };
        let mut forward = DMatrix::<f64>::identity(12, 12);
        (0..6).for_each(|i| forward[(i, i + 6)] = 0.2);
        let twice = &forward * noise(0.2) * forward.transpose() + noise(0.2);
        assert!((twice - noise(0.4)).abs().max() < 1e-9);
    }
}
